#include "kinespace/synthesis/seam.h"

#include <algorithm>
#include <cmath>

#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

constexpr double margin_s = 0.25;
constexpr double share = 0.99;
// Below these nothing moves: sources that rest give ratios to them rather than to zero.
constexpr double least_usual_speed = 5;    // cm/s
constexpr double least_acceleration = 50;  // cm/s^2

double percentile(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(values.size()))) - 1;
  const auto place = values.begin() + std::clamp<std::ptrdiff_t>(at, 0, std::ssize(values) - 1);
  std::ranges::nth_element(values, place);
  return *place;
}

// The largest of the values that lie at (i + offset) / rate within the stretch and its margin.
double largest(const std::vector<double>& values, double offset, double rate_hz, double begin_s, double end_s) {
  double out = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double at = (static_cast<double>(i) + offset) / rate_hz;
    if (at >= begin_s - margin_s && at <= end_s + margin_s) out = std::max(out, values[i]);
  }
  return out;
}

}  // namespace

JointRates joint_rates(const Clip& clip) {
  const JointPositions positions = joint_positions(clip);
  JointRates out{.rate_hz = clip.rate_hz};
  const double squared_hz = clip.rate_hz * clip.rate_hz;
  const int root = clip.skeleton.travel_root();
  for (int f = 0; f + 1 < clip.frames; ++f) {
    double fastest = 0, sharpest = 0;
    for (int j = 0; j < positions.joints; ++j) {
      const Eigen::Vector3d step = positions.at(f + 1, j) - positions.at(f, j);
      fastest = std::max(fastest, step.norm());
      if (f > 0) sharpest = std::max(sharpest, (step - (positions.at(f, j) - positions.at(f - 1, j))).norm());
    }
    out.speed.push_back(fastest * clip.rate_hz);
    if (f == 0) continue;
    out.acceleration.push_back(sharpest * squared_hz);
    const Eigen::Vector3d bend = positions.at(f + 1, root) - 2 * positions.at(f, root) + positions.at(f - 1, root);
    out.root_acceleration.push_back(bend.norm() * squared_hz);
  }
  return out;
}

UsualRates usual_rates(std::span<const JointRates* const> sources) {
  std::vector<double> speed, acceleration, root;
  for (const JointRates* source : sources) {
    speed.insert(speed.end(), source->speed.begin(), source->speed.end());
    acceleration.insert(acceleration.end(), source->acceleration.begin(), source->acceleration.end());
    root.insert(root.end(), source->root_acceleration.begin(), source->root_acceleration.end());
  }
  return {std::max(percentile(speed), least_usual_speed), std::max(percentile(acceleration), least_acceleration),
          std::max(percentile(root), least_acceleration)};
}

SeamRatios seam_ratios(const JointRates& clip, double begin_s, double end_s, const UsualRates& usual) {
  return {largest(clip.speed, 0.5, clip.rate_hz, begin_s, end_s) / usual.speed,
          largest(clip.acceleration, 1, clip.rate_hz, begin_s, end_s) / usual.acceleration,
          largest(clip.root_acceleration, 1, clip.rate_hz, begin_s, end_s) / usual.root_acceleration};
}

}  // namespace kinespace
