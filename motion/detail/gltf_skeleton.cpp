#include "kinespace/motion/detail/gltf_skeleton.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

namespace kinespace {
namespace {

using Nodes = std::vector<int>;

GltfRest rest_of(const gltf::Placement& placement, int node, const gltf::Accessors& accessors) {
  GltfRest out;
  if (placement.matrix) {
    const Eigen::Matrix4d m = Eigen::Map<const Eigen::Matrix4d>(placement.matrix->data());
    out.translation = m.topRightCorner<3, 1>();
    if (nearest_rotation(m.topLeftCorner<3, 3>(), out.rotation)) {
      out.stretch = out.rotation.toRotationMatrix().transpose() * m.topLeftCorner<3, 3>();
    } else {
      out.stretch = m.topLeftCorner<3, 3>();
    }
  } else {
    out.translation = Eigen::Map<const Eigen::Vector3d>(placement.translation.data());
    const auto& q = placement.rotation;
    out.rotation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
    const double length = out.rotation.norm();
    if (!(length > 1e-6)) accessors.fail(fmt::format("a rotation of length {} at node {}", length, node), "1");
    out.rotation.coeffs() /= length;
    out.stretch = Eigen::Map<const Eigen::Vector3d>(placement.scale.data()).asDiagonal();
  }
  if (!out.translation.allFinite() || !out.rotation.coeffs().allFinite() || !out.stretch.allFinite()) {
    accessors.fail(fmt::format("node {} placed at what is no number", node), "finite numbers");
  }
  return out;
}

class SkeletonFinder {
 public:
  SkeletonFinder(const gltf::Document& document, const gltf::Accessors& accessors)
      : document_(document),
        accessors_(accessors),
        tree_(gltf::node_tree(document, accessors)),
        joint_(document.nodes.size(), -1),
        animated_(document.nodes.size(), 0) {
    accessors.budget().take("nodes", document.nodes.size(), sizeof(GltfRest) + sizeof(Eigen::Matrix4d));
  }

  GltfSkeleton find() && {
    find_animated();
    for (std::size_t n = 0; n < document_.nodes.size(); ++n) {
      out_.rest.push_back(rest_of(document_.nodes[n].rest, static_cast<int>(n), accessors_));
    }
    find_skins();
    std::vector<char> wanted = skins_.empty() ? animated_tree() : skin_joints();
    const int root = common_ancestor(wanted);
    if (root >= 0) wanted[static_cast<std::size_t>(root)] = 1;
    add_joints(ordered(wanted, root), wanted, root);
    find_binds();
    find_ends();
    return std::move(out_);
  }

 private:
  void find_animated() {
    for (const gltf::Animation& animation : document_.animations) {
      for (const auto& channel : animation.channels) {
        const bool moves = channel.path != gltf::Animation::Path::weights;
        if (moves && static_cast<std::size_t>(channel.node) < animated_.size()) {
          animated_[static_cast<std::size_t>(channel.node)] = 1;
        }
      }
    }
  }

  // Those that the scene shows; where it shows none, all: a file may hold a skeleton without its mesh.
  void find_skins() {
    mesh_node_.assign(document_.skins.size(), -1);
    for (const int n : tree_.order) {
      const int skin = document_.nodes[static_cast<std::size_t>(n)].skin;
      if (skin < 0 || tree_.shown[static_cast<std::size_t>(n)] == 0) continue;
      if (static_cast<std::size_t>(skin) >= document_.skins.size()) {
        accessors_.fail(fmt::format("skin {}", skin), fmt::format("fewer than {}", document_.skins.size()));
      }
      int& mesh_node = mesh_node_[static_cast<std::size_t>(skin)];
      if (mesh_node < 0) mesh_node = n;
    }
    const bool any = std::ranges::any_of(mesh_node_, [](int n) { return n >= 0; });
    for (std::size_t s = 0; s < document_.skins.size(); ++s) {
      if ((mesh_node_[s] >= 0 || !any) && !document_.skins[s].joints.empty()) skins_.push_back(s);
    }
  }

  std::vector<char> skin_joints() {
    std::vector<char> wanted(document_.nodes.size(), 0);
    for (const std::size_t s : skins_) {
      for (const int n : document_.skins[s].joints) {
        if (n < 0 || static_cast<std::size_t>(n) >= wanted.size()) {
          accessors_.fail(fmt::format("a skin with joint {}", n), "a node of the file");
        }
        if (std::exchange(wanted[static_cast<std::size_t>(n)], char{1}) == 0) preferred_.push_back(n);
      }
    }
    return wanted;
  }

  // What an animation moves in the scene, all below it, and what joins that.
  std::vector<char> animated_tree() {
    std::vector<char> wanted(document_.nodes.size(), 0);
    for (std::size_t n = 0; n < wanted.size(); ++n) {
      wanted[n] = animated_[n] != 0 && tree_.shown[n] != 0 ? 1 : 0;
    }
    if (std::ranges::find(wanted, 1) == wanted.end()) {
      accessors_.fail("no skin, and no animation that moves a node", "a skeleton, or something that moves",
                      "for its shapes: `kinespace mesh`");
    }
    const int top = common_ancestor(wanted);
    for (auto n = tree_.order.rbegin(); n != tree_.order.rend(); ++n) {  // up to what they share
      const int parent = tree_.parent[static_cast<std::size_t>(*n)];
      if (wanted[static_cast<std::size_t>(*n)] != 0 && parent >= 0 && *n != top)
        wanted[static_cast<std::size_t>(parent)] = 1;
    }
    for (const int n : tree_.order) {
      const int parent = tree_.parent[static_cast<std::size_t>(n)];
      if (parent >= 0 && wanted[static_cast<std::size_t>(parent)] != 0) wanted[static_cast<std::size_t>(n)] = 1;
    }
    return wanted;
  }

  // The deepest node that has all of them at or below it; -1 when there is none.
  int common_ancestor(const std::vector<char>& wanted) const {
    std::vector<std::size_t> below(wanted.begin(), wanted.end());
    const auto all = static_cast<std::size_t>(std::ranges::count(wanted, 1));
    int out = -1;
    for (auto n = tree_.order.rbegin(); n != tree_.order.rend() && out < 0; ++n) {
      const std::size_t here = below[static_cast<std::size_t>(*n)];
      const int parent = tree_.parent[static_cast<std::size_t>(*n)];
      if (here == all) out = *n;
      if (parent >= 0) below[static_cast<std::size_t>(parent)] += here;
    }
    return out;
  }

  // In the order of the skins where that has parents first, else as a walk through the tree meets them.
  Nodes ordered(const std::vector<char>& wanted, int root) const {
    if (!preferred_.empty()) {
      Nodes out = preferred_;
      if (root >= 0 && std::ranges::find(out, root) == out.end()) out.insert(out.begin(), root);
      if (parents_first(out, wanted, root)) return out;
    }
    Nodes out, pending;
    for (auto n = tree_.order.rbegin(); n != tree_.order.rend(); ++n) {
      if (tree_.parent[static_cast<std::size_t>(*n)] < 0) pending.push_back(*n);
    }
    while (!pending.empty()) {
      const int n = pending.back();
      pending.pop_back();
      if (wanted[static_cast<std::size_t>(n)] != 0) out.push_back(n);
      const auto& children = document_.nodes[static_cast<std::size_t>(n)].children;
      pending.insert(pending.end(), children.rbegin(), children.rend());
    }
    return out;
  }

  // The nearest one above it; -1 when there is none. What lies between goes to `links`, with the node itself.
  int joint_above(int node, const std::vector<char>& wanted, Nodes& links) const {
    links.push_back(node);
    int at = tree_.parent[static_cast<std::size_t>(node)];
    for (; at >= 0 && wanted[static_cast<std::size_t>(at)] == 0; at = tree_.parent[static_cast<std::size_t>(at)]) {
      links.push_back(at);
    }
    accessors_.budget().take("joints", links.size(), sizeof(int));
    return at;
  }

  // `root`: all hang on it; else there may be several trees.
  bool parents_first(const Nodes& nodes, const std::vector<char>& wanted, int root) const {
    std::vector<char> met(wanted.size(), 0);
    for (const int n : nodes) {
      Nodes links;
      const int above = joint_above(n, wanted, links);
      if (above < 0 ? root >= 0 && n != nodes.front() : met[static_cast<std::size_t>(above)] == 0) return false;
      met[static_cast<std::size_t>(n)] = 1;
    }
    return true;
  }

  void add_joints(const Nodes& nodes, const std::vector<char>& wanted, int root_node) {
    if (root_node < 0) {
      out_.joints.emplace_back();
      const gltf::Scene* const scene = gltf::default_scene(document_, accessors_);
      out_.root_name = scene == nullptr || scene->name.empty() ? "scene" : scene->name;
    }
    const int root = out_.joints.empty() ? -1 : 0;
    for (const int n : nodes) {
      GltfJoint joint{.node = n};
      const int above = joint_above(n, wanted, joint.links);
      std::ranges::reverse(joint.links);
      joint.parent = above < 0 ? root : joint_[static_cast<std::size_t>(above)];
      joint_[static_cast<std::size_t>(n)] = static_cast<int>(out_.joints.size());
      out_.joints.push_back(std::move(joint));
    }
  }

  void find_binds() {
    std::vector<Eigen::Affine3d> world(document_.nodes.size());
    std::vector<Eigen::Quaterniond> turn(document_.nodes.size());
    for (const int n : tree_.order) {
      const auto at = static_cast<std::size_t>(n);
      const GltfRest& rest = out_.rest[at];
      Eigen::Affine3d local;
      local.linear() = rest.rotation.toRotationMatrix() * rest.stretch;
      local.translation() = rest.translation;
      local.makeAffine();
      const int parent = tree_.parent[at];
      world[at] = parent < 0 ? local : Eigen::Affine3d(world[static_cast<std::size_t>(parent)] * local);
      turn[at] = (parent < 0 ? rest.rotation : turn[static_cast<std::size_t>(parent)] * rest.rotation).normalized();
    }
    for (GltfJoint& joint : out_.joints) {
      if (joint.node < 0) continue;
      joint.bind = turn[static_cast<std::size_t>(joint.node)];
      joint.bind_position = world[static_cast<std::size_t>(joint.node)].translation();
      const int above = tree_.parent[static_cast<std::size_t>(joint.node)];
      if (above >= 0)
        joint.scale_above = std::cbrt(std::abs(world[static_cast<std::size_t>(above)].linear().determinant()));
    }
    for (auto skin = skins_.rbegin(); skin != skins_.rend(); ++skin) bind_to_skin(*skin, world);  // the first has it
  }

  void bind_to_skin(std::size_t index, const std::vector<Eigen::Affine3d>& world) {
    const gltf::Skin& skin = document_.skins[index];
    if (skin.inverse_binds < 0) return;
    const std::vector<float> numbers = accessors_.floats(skin.inverse_binds, 16);
    if (numbers.size() < skin.joints.size() * 16) {
      accessors_.fail("a skin with fewer matrices than joints", "one for each");
    }
    const int mesh_node = mesh_node_[index];
    const Eigen::Affine3d mesh =
        mesh_node < 0 ? Eigen::Affine3d::Identity() : world[static_cast<std::size_t>(mesh_node)];
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      GltfJoint& joint = out_.joints[static_cast<std::size_t>(joint_[static_cast<std::size_t>(skin.joints[j])])];
      Eigen::Affine3d inverse;
      inverse.matrix() = Eigen::Map<const Eigen::Matrix4f>(numbers.data() + 16 * j).cast<double>();
      inverse.makeAffine();
      Eigen::Quaterniond unused;
      if (!inverse.matrix().allFinite() || !nearest_rotation(inverse.linear(), unused)) continue;  // the node's stays
      const Eigen::Affine3d bound = mesh * inverse.inverse();
      Eigen::Quaterniond turn;
      if (!bound.matrix().allFinite() || !nearest_rotation(bound.linear(), turn)) continue;
      joint.bind = turn;
      joint.bind_position = bound.translation();
    }
  }

  // The end of a leaf's bone: a node below it that holds nothing and does nothing.
  void find_ends() {
    std::vector<char> has_children(out_.joints.size(), 0);
    for (const GltfJoint& joint : out_.joints) {
      if (joint.parent >= 0) has_children[static_cast<std::size_t>(joint.parent)] = 1;
    }
    for (std::size_t j = 0; j < out_.joints.size(); ++j) {
      GltfJoint& joint = out_.joints[j];
      if (joint.node < 0 || has_children[j] != 0) continue;
      const auto& children = document_.nodes[static_cast<std::size_t>(joint.node)].children;
      const auto end = std::ranges::find_if(children, [&](int child) {
        const gltf::Node& node = document_.nodes[static_cast<std::size_t>(child)];
        return node.mesh < 0 && node.children.empty() && animated_[static_cast<std::size_t>(child)] == 0;
      });
      if (end != children.end()) joint.end = *end;
    }
  }

  const gltf::Document& document_;
  const gltf::Accessors& accessors_;
  gltf::NodeTree tree_;
  Nodes joint_;                     // by node: its joint, -1
  std::vector<char> animated_;      // by node, by any animation
  std::vector<std::size_t> skins_;  // those whose joints are wanted
  Nodes mesh_node_;                 // by skin: the first node that shows it, -1
  Nodes preferred_;                 // the skins' joints in their order
  GltfSkeleton out_;
};

}  // namespace

bool nearest_rotation(const Eigen::Matrix3d& matrix, Eigen::Quaterniond& out) {
  const double size = matrix.norm();
  if (!std::isfinite(size) || !(size > 0)) return false;
  Eigen::Matrix3d turn = matrix / size;
  if (!(std::abs(turn.determinant()) > 1e-18)) return false;
  // Newton's iteration for the polar factor (Higham, Functions of Matrices, section 8.3), from a matrix of size 1.
  constexpr int most_steps = 100;
  for (int step = 0; step < most_steps; ++step) {
    const Eigen::Matrix3d next = 0.5 * (turn + turn.inverse().transpose());
    const double moved = (next - turn).norm();
    turn = next;
    if (moved < 1e-15) break;
  }
  if (turn.determinant() < 0) turn = -turn;
  if (!turn.isUnitary(1e-9)) return false;
  out = Eigen::Quaterniond(turn).normalized();
  return true;
}

GltfSkeleton gltf_skeleton(const gltf::Document& document, const gltf::Accessors& accessors) {
  return SkeletonFinder(document, accessors).find();
}

}  // namespace kinespace
