#include "kinespace/motion/plausibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

constexpr int fewest_joints = 5;
constexpr double shortest_cm = 80;
constexpr double tallest_cm = 300;
constexpr double lying_ratio = 1.5;
constexpr double floor_share = 0.25;
constexpr int frames_looked_at = 200;

// What the body covers in the world over the frames that are looked at.
struct Reach {
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();  // medians over frames, cm
  double lowest = 0;                                 // of the lowest joint: the tenth part of frames is lower, cm
};

double quantile(std::vector<double>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

Reach reach_of(const Clip& clip) {
  const auto root = static_cast<std::size_t>(clip.skeleton.travel_root());  // those above do not move with the body
  const int looked_at = std::min(clip.frames, frames_looked_at);
  std::array<std::vector<double>, 3> extents;
  std::vector<double> lowest;
  std::vector<JointFrame> joints;
  for (int i = 0; i < looked_at; ++i) {
    const auto frame = static_cast<int>(static_cast<std::int64_t>(i) * (clip.frames - 1) / std::max(1, looked_at - 1));
    world_frames(clip, frame, joints);
    Eigen::AlignedBox3d box;
    for (std::size_t j = root; j < joints.size(); ++j) box.extend(joints[j].position);
    for (int axis = 0; axis < 3; ++axis) extents[static_cast<std::size_t>(axis)].push_back(box.sizes()(axis));
    lowest.push_back(box.min().y());
  }
  Reach out{.lowest = quantile(lowest, 0.1)};
  for (int axis = 0; axis < 3; ++axis) out.extent(axis) = quantile(extents[static_cast<std::size_t>(axis)], 0.5);
  return out;
}

}  // namespace

std::vector<Doubt> doubts_about(const Clip& clip) {
  std::vector<Doubt> out;
  const double height = clip.skeleton.rest_height();
  if (clip.skeleton.joint_count() < fewest_joints || !(height > 0)) return out;
  if (height < shortest_cm || height > tallest_cm) {
    const std::string unit = guess_unit(height);
    const bool known = unit != "unknown" && unit != "cm";
    out.push_back(
        {DoubtKind::height, fmt::format("the skeleton is {:.3g} cm tall, a person {} to {}: lengths are taken as cm{}",
                                        height, shortest_cm, tallest_cm, known ? ", are they in " + unit + "?" : "")});
  }
  const Reach reach = reach_of(clip);
  const int longest = reach.extent.x() > reach.extent.z() ? 0 : 2;
  if (reach.extent(longest) > lying_ratio * reach.extent.y()) {
    out.push_back(
        {DoubtKind::axis,
         fmt::format("the body is long along {0}, {1:.3g} cm, not along Y, {2:.3g} cm: Y is taken as up, is {0} "
                     "up in the file?",
                     longest == 0 ? 'X' : 'Z', reach.extent(longest), reach.extent.y())});
  } else if (std::abs(reach.lowest) > floor_share * height) {
    out.push_back(
        {DoubtKind::floor, fmt::format("the lowest joint is at {:.3g} cm, the floor of most files at 0: is the "
                                       "body raised or sunk?",
                                       reach.lowest)});
  }
  return out;
}

std::string guess_unit(double height) {
  struct Range {
    double low, high;
    const char* unit;
  };
  constexpr std::array ranges{Range{0.5, 2.5, "m"}, Range{20, 95, "inch"}, Range{95, 250, "cm"},
                              Range{500, 2500, "mm"}};
  for (const auto& [low, high, unit] : ranges) {
    if (height >= low && height < high) return unit;
  }
  return "unknown";
}

}  // namespace kinespace
