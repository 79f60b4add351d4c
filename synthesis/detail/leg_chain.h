// A leg in the poses of a player. Private to this folder.
#pragma once

#include <algorithm>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "kinespace/footskate/foot_planter.h"

namespace kinespace {

// The bones from the travel root to the end of a foot, and which of them are its joints.
class LegChain {
 public:
  LegChain(const Skeleton& skeleton, const Leg& leg) {
    const int end = leg.toe >= 0 ? leg.toe : leg.ankle;
    const std::vector<int> rotating = skeleton.rotating_joints();
    for (int j = end; j != skeleton.travel_root(); j = skeleton.joints[static_cast<std::size_t>(j)].parent) {
      const auto found = std::ranges::find(rotating, j);
      bones_.push_back({.offset = skeleton.joints[static_cast<std::size_t>(j)].offset,
                        .rotation = found == rotating.end() ? -1 : static_cast<int>(found - rotating.begin()),
                        .joint = j});
    }
    std::ranges::reverse(bones_);
    for (std::size_t i = 0; i < bones_.size(); ++i) {
      if (bones_[i].joint == leg.hip) hip_ = i;
      if (bones_[i].joint == leg.knee) knee_ = i;
      if (bones_[i].joint == leg.ankle) ankle_ = i;
    }
  }

  // Whether the player turns its joints.
  [[nodiscard]] bool turns() const {
    return bones_[hip_].rotation >= 0 && bones_[knee_].rotation >= 0 && bones_[ankle_].rotation >= 0;
  }

  [[nodiscard]] LegState state(const Eigen::Vector3f& root, std::span<const float> rotations) const {
    JointFrame at{.rotation = rotation(rotations, 0), .position = root.cast<double>()};
    LegState out;
    for (std::size_t i = 0; i < bones_.size(); ++i) {
      const Bone& bone = bones_[i];
      const Eigen::Quaterniond above = at.rotation;
      at.position += at.rotation * bone.offset;
      if (bone.rotation >= 0) at.rotation = at.rotation * rotation(rotations, bone.rotation);
      if (i == hip_) std::tie(out.above_hip, out.hip) = std::pair(above, at);
      if (i == knee_) std::tie(out.above_knee, out.knee) = std::pair(above, at);
      if (i == ankle_) std::tie(out.above_ankle, out.ankle) = std::pair(above, at);
    }
    out.toe = at.position;
    return out;
  }

  void put(const LegRotations& turned, std::span<float> rotations) const {
    set(turned.hip, bones_[hip_].rotation, rotations);
    set(turned.knee, bones_[knee_].rotation, rotations);
    set(turned.ankle, bones_[ankle_].rotation, rotations);
  }

 private:
  struct Bone {
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    int rotation = -1;  // of the player's
    int joint = -1;
  };

  [[nodiscard]] static Eigen::Quaterniond rotation(std::span<const float> rotations, int index) {
    const float* q = rotations.data() + 4 * static_cast<std::ptrdiff_t>(index);
    return Eigen::Quaternionf(q[0], q[1], q[2], q[3]).cast<double>();
  }
  // On the side that the pose had.
  static void set(const Eigen::Quaterniond& q, int index, std::span<float> rotations) {
    float* out = rotations.data() + 4 * static_cast<std::ptrdiff_t>(index);
    const double sign = q.dot(rotation(rotations, index)) < 0 ? -1 : 1;
    out[0] = static_cast<float>(sign * q.w());
    out[1] = static_cast<float>(sign * q.x());
    out[2] = static_cast<float>(sign * q.y());
    out[3] = static_cast<float>(sign * q.z());
  }

  std::vector<Bone> bones_;
  std::size_t hip_ = 0;
  std::size_t knee_ = 0;
  std::size_t ankle_ = 0;
};

}  // namespace kinespace
