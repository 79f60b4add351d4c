#include "kinespace/codecs/stream/clip_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

// A double as a float that is not less.
double rounded_up(double value) {
  const auto near = static_cast<float>(value);
  if (static_cast<double>(near) >= value) return near;
  return std::nextafter(near, std::numeric_limits<float>::infinity());
}

// take(error) of every joint of every frame, in order.
template <typename Take>
void measure_joints(const Clip& original, const Clip& decoded, int first, int count, int decoded_first,
                    const Take& take) {
  std::vector<JointFrame> a, b;
  for (int f = 0; f < count; ++f) {
    world_frames(original, first + f, a);
    world_frames(decoded, decoded_first + f, b);
    for (std::size_t j = 0; j < a.size(); ++j) {
      const Eigen::Vector3d apart = a[j].position - b[j].position;
      const Eigen::Matrix3d turned = shell_cm * (a[j].rotation.toRotationMatrix() - b[j].rotation.toRotationMatrix());
      double worst = 0;
      for (int k = 0; k < 3; ++k) worst = std::max(worst, (turned.col(k) + apart).squaredNorm());
      take(JointError{.distance = apart.norm(), .shell = std::sqrt(worst)});
    }
  }
}

}  // namespace

void ClipErrorSums::add(const ClipErrorSums& other) {
  distance += other.distance;
  largest = std::max(largest, other.largest);
  shell += other.shell;
  count += other.count;
}

void ClipErrorSums::add(const JointError& joint) {
  distance += joint.distance;
  largest = std::max(largest, joint.distance);
  shell += joint.shell;
  ++count;
}

MeasuredError ClipErrorSums::measured() const {
  return {.mean_joint_error_cm = rounded_up(mean_cm()),
          .max_joint_error_cm = rounded_up(largest),
          .shell_error_cm = rounded_up(shell_cm())};
}

ClipErrorSums clip_error(const Clip& original, const Clip& decoded, int first, int count, int decoded_first) {
  ClipErrorSums out;
  measure_joints(original, decoded, first, count, decoded_first, [&](const JointError& joint) { out.add(joint); });
  return out;
}

void append_joint_errors(const Clip& original, const Clip& decoded, int first, int count, int decoded_first,
                         std::vector<JointError>& out) {
  measure_joints(original, decoded, first, count, decoded_first,
                 [&](const JointError& joint) { out.push_back(joint); });
}

double raw_bytes(const Clip& clip) {
  return 4.0 * clip.frames * (3.0 + 3.0 * static_cast<double>(clip.skeleton.rotating_joints().size()));
}

}  // namespace kinespace
