#include "kinespace/gltf/nodes.h"

#include <fmt/format.h>

namespace kinespace::gltf {
namespace {

bool is_node(const Document& document, int node) {
  return node >= 0 && static_cast<std::size_t>(node) < document.nodes.size();
}

void find_parents(const Document& document, const Accessors& accessors, NodeTree& tree) {
  for (std::size_t n = 0; n < document.nodes.size(); ++n) {
    for (const int child : document.nodes[n].children) {
      if (!is_node(document, child) || tree.parent[static_cast<std::size_t>(child)] >= 0) {
        accessors.fail(fmt::format("node {} has child {}", n, child), "a node of the file with one parent");
      }
      tree.parent[static_cast<std::size_t>(child)] = static_cast<int>(n);
    }
  }
}

void find_order(const Document& document, const Accessors& accessors, NodeTree& tree) {
  for (std::size_t n = 0; n < tree.parent.size(); ++n) {
    if (tree.parent[n] < 0) tree.order.push_back(static_cast<int>(n));
  }
  for (std::size_t i = 0; i < tree.order.size(); ++i) {
    const auto& children = document.nodes[static_cast<std::size_t>(tree.order[i])].children;
    tree.order.insert(tree.order.end(), children.begin(), children.end());
  }
  if (tree.order.size() != tree.parent.size()) accessors.fail("nodes that are their own ancestors", "a tree");
}

void find_shown(const Document& document, const Accessors& accessors, NodeTree& tree) {
  const Scene* const scene = default_scene(document, accessors);
  tree.shown.assign(document.nodes.size(), scene == nullptr ? 1 : 0);
  if (scene == nullptr) return;
  for (const int root : scene->nodes) {
    if (!is_node(document, root)) accessors.fail(fmt::format("node {} in a scene", root), "a node of the file");
    tree.shown[static_cast<std::size_t>(root)] = 1;
  }
  for (const int n : tree.order) {
    const int parent = tree.parent[static_cast<std::size_t>(n)];
    if (parent >= 0 && tree.shown[static_cast<std::size_t>(parent)] != 0) tree.shown[static_cast<std::size_t>(n)] = 1;
  }
}

}  // namespace

const Scene* default_scene(const Document& document, const Accessors& accessors) {
  if (document.scenes.empty()) return nullptr;
  const int scene = document.scene < 0 ? 0 : document.scene;
  if (static_cast<std::size_t>(scene) >= document.scenes.size()) {
    accessors.fail(fmt::format("scene {}", scene), fmt::format("fewer than {}", document.scenes.size()));
  }
  return &document.scenes[static_cast<std::size_t>(scene)];
}

NodeTree node_tree(const Document& document, const Accessors& accessors) {
  NodeTree out;
  out.parent.assign(document.nodes.size(), -1);
  find_parents(document, accessors, out);
  find_order(document, accessors, out);
  find_shown(document, accessors, out);
  return out;
}

}  // namespace kinespace::gltf
