// How far the joints of two clips are apart, part by part: for what must not hold all of a long clip. Whole clips have
// compare (motion/error_measures.h).
#pragma once

#include <algorithm>
#include <cassert>

#include "kinespace/motion/kinematics.h"

namespace kinespace {

class JointDistance {
 public:
  // The largest distance of this part; both of the same frames and joints.
  double add(const JointPositions& a, const JointPositions& b) {
    assert(a.values.size() == b.values.size());
    double largest = 0;
    for (std::size_t i = 0; i < a.values.size(); ++i) {
      const double distance = (a.values[i] - b.values[i]).norm();
      sum_ += distance;
      largest = std::max(largest, distance);
    }
    count_ += a.values.size();
    largest_ = std::max(largest_, largest);
    return largest;
  }

  // cm; 0 before anything was added.
  [[nodiscard]] double mean() const { return count_ > 0 ? sum_ / static_cast<double>(count_) : 0; }
  [[nodiscard]] double largest() const { return largest_; }

 private:
  double sum_ = 0;
  double largest_ = 0;
  std::size_t count_ = 0;
};

}  // namespace kinespace
