// ASF (Acclaim skeleton) files to skeletons and back.
//
// Format: Acclaim skeleton file definition 1.10 (M. Schafer, 1994), as VICON writes it. '#' starts a comment, commas
// and parentheses are white space, words are in any case, sections come in any order and unknown ones are passed over.
//
// What a bone becomes: a joint of the bone's name, in the order of the file but never before its parent, where the bone
// *starts* (its centre of rotation). So joint b's offset is its parent bone's vector (direction * length), a child of
// the root has offset zero, and the end of a leaf bone is an end site. The root is the joint "root".
//
//  - cm = value / (:units length) * 2.54; angles in degrees or, with "angle rad", in radians.
//  - `axis a b c XYZ`: C turns about X, then Y, then Z of the fixed frame: C = Rz(c) Ry(b) Rx(a); for other letters in
//    their order. A bone's rotation is C Rz Ry Rx C^-1 of its dof values, whatever the order of its dofs, which only
//    says how the values stand in the AMC. That is no single Euler axis unless C is, so every bone with a rotation dof
//    gets the three channels Z Y X, whatever its axis: skeletons of two subjects then have the same tree.
//  - dofs tx ty tz move the bone's start, by C t; such a joint has position channels before its rotations. The dof l (a
//    bone that stretches) has no place in a skeleton of rigid bones: a clear error.
//  - :root `order` says how the root's values stand in the AMC, `axis` the order of its rotations (XYZ: X first).
//    `position` is where the root rests; as the AMC gives the root in the world, it moves no frame. `orientation`
//    likewise.
//
// Bad input throws Error{bad_input} with file and line: a bone without name, direction or length, twice, in no
// hierarchy, in two places or in a cycle; a hierarchy that names unknown bones; numbers that are none, nan or beyond
// 1e9.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "kinespace/motion/clip.h"

namespace kinespace {

struct Asf {
  // Where a value of an AMC line goes: the channels of the format, in the skeleton file's order.
  struct Bone {
    std::vector<Channel> dofs;
    Eigen::Quaterniond axis = Eigen::Quaterniond::Identity();  // C
  };

  Skeleton skeleton;                         // joint 0 is "root"
  std::vector<Bone> bones;                   // one a joint
  std::array<int, 3> root_axes = {2, 1, 0};  // the root's rotation is R(first) R(second) R(third); 0, 1, 2 for X, Y, Z
  double cm_per_unit = 2.54;
  bool radians = false;
};

[[nodiscard]] Asf parse_asf(std::string_view text, const std::string& source_name);
[[nodiscard]] Asf read_asf(const std::filesystem::path& path);

}  // namespace kinespace
