// The tree that the nodes of a glTF file make.
#pragma once

#include <vector>

#include "kinespace/gltf/accessors.h"
#include "kinespace/gltf/document.h"

namespace kinespace::gltf {

struct NodeTree {
  std::vector<int> parent;  // -1 for a root
  std::vector<int> order;   // every node once, parents first
  std::vector<char> shown;  // whether the node is in the default scene: the file's own choice, else the first of its
                            // scenes, else (there is none) all nodes
};

// Throws Error{bad_input} for a node that is its own ancestor or has two parents, and for a scene that is not there or
// names what is no node.
[[nodiscard]] NodeTree node_tree(const Document& document, const Accessors& accessors);

// The default scene; nullptr where the file has none.
[[nodiscard]] const Scene* default_scene(const Document& document, const Accessors& accessors);

}  // namespace kinespace::gltf
