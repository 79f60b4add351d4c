// The skeleton of a clip: a tree of joints with their rest offsets, and how a file lays out their channels.
//
// Units: centimetres, Y up, right-handed. Joints stand in file order, every parent before its children, joint 0 first.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace kinespace {

// One channel of a joint, in the order the file has it. Rotation channels apply left to right: the local rotation is
// the product R(first) * R(second) * R(third) of rotations about the named axes (BVH's convention).
enum class Channel : std::uint8_t { x_position, y_position, z_position, x_rotation, y_rotation, z_rotation };

[[nodiscard]] constexpr bool is_position(Channel c) {
  return c <= Channel::z_position;
}
// 0, 1, 2 for X, Y, Z.
[[nodiscard]] constexpr int axis_of(Channel c) {
  return static_cast<int>(c) % 3;
}

struct Joint {
  std::string name;
  int parent = -1;                                   // index into Skeleton::joints; -1 for joint 0 only
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // cm, in the parent's frame: where the joint is at rest
  std::vector<Channel> channels;                     // at most 6, no channel twice
  std::optional<Eigen::Vector3d> end_site;           // cm, in this joint's frame; only a leaf has one

  [[nodiscard]] bool has_rotation() const;
  [[nodiscard]] bool has_position() const;  // any of the three position channels
};

struct Skeleton {
  std::vector<Joint> joints;

  [[nodiscard]] int joint_count() const { return static_cast<int>(joints.size()); }
  // The index of the joint of that name, -1 when there is none.
  [[nodiscard]] int find(std::string_view name) const;

  // The joint whose travel is the motion's travel ("root" in the papers): joint 0, or below it while a joint has a
  // single child that has position channels of its own (bandai: joint_Root -> Hips).
  [[nodiscard]] int travel_root() const;

  // The joints that carry a rotation curve: the travel root, then every later joint with rotation channels that is not
  // above the travel root, in file order. (cmu: 29 + root as the file has them, bandai: 21.)
  [[nodiscard]] std::vector<int> rotating_joints() const;

  // The height of the rest pose in cm: the extent along Y of all joints and end sites with every rotation zero, or
  // along the longest axis when the rest pose lies (bandai rests along X).
  [[nodiscard]] double rest_height() const;

  // Equal names, parents and channels: clips of such skeletons can share a motion space, whatever their bone lengths.
  [[nodiscard]] bool same_tree(const Skeleton& other) const;

  // 32 hexadecimal digits of what same_tree compares.
  [[nodiscard]] std::string tree_hash() const;
};

}  // namespace kinespace
