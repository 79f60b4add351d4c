// Which nodes of a glTF file are the joints of a skeleton. For motion/gltf_read.cpp only.
//
// The joints are those of the skins that the default scene shows; where there is no skin, the nodes that an animation
// moves with all below them. What lies between two joints, and above the first, is folded into the joint below. Several
// trees hang on the node that they share, or, where they share none, on a joint at the origin.
//
// A joint's frame is turned so that all rotations are zero in the bind pose, as those of BVH are in the rest pose: for
// joints of a skin its inverse bind matrices tell that pose, for others the nodes as the file has them.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "kinespace/gltf/accessors.h"
#include "kinespace/gltf/animation.h"
#include "kinespace/gltf/document.h"
#include "kinespace/gltf/nodes.h"

namespace kinespace {

// A node at rest: where it is in its parent. The linear part is the rotation times the stretch.
struct GltfRest {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Matrix3d stretch = Eigen::Matrix3d::Identity();
};

struct GltfJoint {
  int node = -1;  // -1: a root that the file does not have
  int parent = -1;
  std::vector<int> links;                                    // the nodes below the parent joint's, down to its own
  Eigen::Quaterniond bind = Eigen::Quaterniond::Identity();  // its rotation in the scene, in the bind pose
  Eigen::Vector3d bind_position = Eigen::Vector3d::Zero();   // in the scene, file units
  double scale_above = 1;                                    // of lengths where it is placed, at rest
  int end = -1;                                              // of a leaf: the node at the end of its bone
};

struct GltfSkeleton {
  std::vector<GltfRest> rest;     // by node
  std::vector<GltfJoint> joints;  // parents first
  std::string root_name;          // of a root that the file does not have
};

// Throws Error{bad_input} when the file has neither a skin nor an animation of nodes, and for what does not fit together.
[[nodiscard]] GltfSkeleton gltf_skeleton(const gltf::Document& document, const gltf::Accessors& accessors);

// The rotation nearest to a matrix (its polar factor), a mirroring left out; nothing when it flattens space.
[[nodiscard]] bool nearest_rotation(const Eigen::Matrix3d& matrix, Eigen::Quaterniond& out);

}  // namespace kinespace
