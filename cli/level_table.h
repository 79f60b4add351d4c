// How near each level of detail of a library comes to the clips as they were read.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "cli/json_output.h"
#include "kinespace/fpca/encoding.h"
#include "kinespace/storage/library_rows.h"

namespace kinespace::cli {

// Of all clips whose errors are known: frames count alike.
class LevelTable {
 public:
  void add(const ClipRow& clip, const std::vector<LevelError>& errors);
  // By level: `functions`, `mean_joint_error_cm`, `max_joint_error_cm`, `worst_clip`.
  [[nodiscard]] Json rows() const;

 private:
  struct Sum {
    double frames = 0;
    double error = 0;
    double largest = 0;
    std::string clip;
  };
  std::map<int, Sum> levels_;
};

}  // namespace kinespace::cli
