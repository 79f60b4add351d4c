#include "codecs/clip_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "motion/error_measures.h"
#include "motion/kinematics.h"

namespace kinespace {
namespace {

// A double as a float that is not less.
double rounded_up(double value) {
  const auto near = static_cast<float>(value);
  if (static_cast<double>(near) >= value) return near;
  return std::nextafter(near, std::numeric_limits<float>::infinity());
}

}  // namespace

void ClipErrorSums::add(const ClipErrorSums& other) {
  distance += other.distance;
  largest = std::max(largest, other.largest);
  shell += other.shell;
  count += other.count;
}

MeasuredError ClipErrorSums::measured() const {
  return {.mean_joint_error_cm = rounded_up(mean_cm()),
          .max_joint_error_cm = rounded_up(largest),
          .shell_error_cm = rounded_up(shell_cm())};
}

ClipErrorSums clip_error(const Clip& original, const Clip& decoded, int first, int count, int decoded_first) {
  ClipErrorSums out;
  std::vector<JointFrame> a, b;
  for (int f = 0; f < count; ++f) {
    world_frames(original, first + f, a);
    world_frames(decoded, decoded_first + f, b);
    for (std::size_t j = 0; j < a.size(); ++j) {
      const Eigen::Vector3d apart = a[j].position - b[j].position;
      const double distance = apart.norm();
      const Eigen::Matrix3d turned = shell_cm * (a[j].rotation.toRotationMatrix() - b[j].rotation.toRotationMatrix());
      double worst = 0;
      for (int k = 0; k < 3; ++k) worst = std::max(worst, (turned.col(k) + apart).squaredNorm());
      out.distance += distance;
      out.largest = std::max(out.largest, distance);
      out.shell += std::sqrt(worst);
    }
    out.count += static_cast<std::int64_t>(a.size());
  }
  return out;
}

double raw_bytes(const Clip& clip) {
  return 4.0 * clip.frames * (3.0 + 3.0 * static_cast<double>(clip.skeleton.rotating_joints().size()));
}

}  // namespace kinespace
