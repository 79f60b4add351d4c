#include "cli/level_table.h"

namespace kinespace::cli {

void LevelTable::add(const ClipRow& clip, const std::vector<LevelError>& errors) {
  for (const LevelError& l : errors) {
    Sum& sum = levels_[l.level];
    const auto frames = static_cast<double>(clip.frames);
    sum.frames += frames;
    sum.error += l.error.mean_joint_error_cm * frames;
    if (l.error.max_joint_error_cm > sum.largest) {
      sum.largest = l.error.max_joint_error_cm;
      sum.clip = clip.name;
    }
  }
}

Json LevelTable::rows() const {
  Json out = Json::array();
  for (const auto& [level, sum] : levels_) {
    out.push_back({{"functions", level},
                   {"mean_joint_error_cm", sum.error / sum.frames},
                   {"max_joint_error_cm", sum.largest},
                   {"worst_clip", sum.clip}});
  }
  return out;
}

}  // namespace kinespace::cli
