// What ran where, stage by stage: seconds, and what the kernels of each family did.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "cli/json_output.h"
#include "cli/session.h"
#include "kinespace/base/progress.h"
#include "kinespace/kernels/device.h"

namespace kinespace::cli {

class StageLog {
 public:
  // From now on, by the kernels of this Compute and its copies.
  explicit StageLog(Compute compute) : compute_(std::move(compute)) {}
  StageLog(const StageLog&) = delete;
  StageLog& operator=(const StageLog&) = delete;

  // The same progress; what it is told of stages is logged, too. The log must outlive it.
  [[nodiscard]] Progress watch(Progress progress);
  // The stage before ends here. A stage that comes again goes on with its sums.
  void begin(std::string_view stage);

  // Ends the last stage and puts the keys `device` (in words) and `stages` into the object: a list of `stage`, `seconds`
  // and `kernels`, those families that ran, with `kernel`, `launches` (of OpenCL kernels, on the device) and
  // `processor_calls`. With -v the session tells the same in lines.
  void finish(Json& object, Session& session);

 private:
  struct Stage {
    std::string name;
    double seconds = 0;
    KernelUses uses = {};
  };
  void end();

  Compute compute_;
  std::mutex mutex_;
  std::vector<Stage> stages_;  // in the order in which they came first
  std::size_t current_ = 0;
  std::chrono::steady_clock::time_point start_;
  KernelUses uses_before_ = {};
};

}  // namespace kinespace::cli
