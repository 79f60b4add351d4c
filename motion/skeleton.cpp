#include "kinespace/motion/skeleton.h"

#include <algorithm>
#include <span>

#include "kinespace/base/bytes.h"
#include "kinespace/base/file.h"

namespace kinespace {

bool Joint::has_rotation() const {
  return std::ranges::any_of(channels, [](Channel c) { return !is_position(c); });
}

bool Joint::has_position() const {
  return std::ranges::any_of(channels, is_position);
}

int Skeleton::find(std::string_view name) const {
  const auto found = std::ranges::find(joints, name, &Joint::name);
  return found == joints.end() ? -1 : static_cast<int>(found - joints.begin());
}

int Skeleton::travel_root() const {
  int root = 0;
  for (;;) {
    int child = -1;
    int children = 0;
    for (int j = root + 1; j < joint_count(); ++j) {
      if (joints[static_cast<std::size_t>(j)].parent == root) {
        child = j;
        ++children;
      }
    }
    if (children != 1 || !joints[static_cast<std::size_t>(child)].has_position()) return root;
    root = child;
  }
}

std::vector<int> Skeleton::rotating_joints() const {
  const int root = travel_root();  // joints above it all come before it: each has it as its only child
  std::vector<int> out{root};
  for (int j = root + 1; j < joint_count(); ++j) {
    if (joints[static_cast<std::size_t>(j)].has_rotation()) out.push_back(j);
  }
  return out;
}

double Skeleton::rest_height() const {
  if (joints.empty()) return 0;
  std::vector<Eigen::Vector3d> position(joints.size(), Eigen::Vector3d::Zero());
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();
  const auto root = static_cast<std::size_t>(travel_root());
  for (std::size_t j = root; j < joints.size(); ++j) {
    if (j > root) position[j] = position[static_cast<std::size_t>(joints[j].parent)] + joints[j].offset;
    low = low.cwiseMin(position[j]);
    high = high.cwiseMax(position[j]);
    if (joints[j].end_site) {
      low = low.cwiseMin(position[j] + *joints[j].end_site);
      high = high.cwiseMax(position[j] + *joints[j].end_site);
    }
  }
  const Eigen::Vector3d extent = high - low;
  return extent.y() >= 0.5 * extent.maxCoeff() ? extent.y() : extent.maxCoeff();
}

bool Skeleton::same_tree(const Skeleton& other) const {
  return std::ranges::equal(joints, other.joints, [](const Joint& a, const Joint& b) {
    return a.name == b.name && a.parent == b.parent && a.channels == b.channels;
  });
}

std::string Skeleton::tree_hash() const {
  ByteWriter out;
  for (const Joint& joint : joints) {
    out.put_string(joint.name);
    out.put(joint.parent);
    out.put(static_cast<std::uint8_t>(joint.channels.size()));
    for (const Channel c : joint.channels) out.put(static_cast<std::uint8_t>(c));
  }
  return content_hash(out.bytes());
}

}  // namespace kinespace
