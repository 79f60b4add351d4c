// The entropy coder of what moves on a mesh: whole numbers [component][node][axis], most of them zero.
//
// Nodes are smooth functions or vertices; a list of nodes near each tells where to expect what. Components come in
// order of their energy (principal components over time, or cosines). Expectations for a number come from the nodes
// near it in the same component, the other axes, the components before it at the same node, and how lively node and
// neighbourhood were in all components so far; mixed_bits.h weighs them.
//
// The encoder chooses numbers for least squared error + rate_weight * bits.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"

namespace kinespace {

struct NodeGraph {
  std::vector<std::int32_t> first;  // nodes + 1 numbers
  std::vector<std::int32_t> near;   // of node n: near[first[n]] to near[first[n + 1]]
  std::vector<std::uint8_t> band;   // a class of each node, below `bands`
  static constexpr int bands = 16;

  [[nodiscard]] int nodes() const { return static_cast<int>(band.size()); }
  [[nodiscard]] std::span<const std::int32_t> of(int node) const {
    const auto n = static_cast<std::size_t>(node);
    return std::span(near).subspan(static_cast<std::size_t>(first[n]),
                                   static_cast<std::size_t>(first[n + 1] - first[n]));
  }
};

// Values in quantiser steps, three axes for each node, a component after the other.
struct NodeValues {
  int components = 0;
  std::vector<double> value;  // [component][node][axis]
};

struct CodedNodes {
  Bytes bytes;
  NodeValues decoded;
  double squared_error = 0;  // in squared steps
};
[[nodiscard]] CodedNodes encode_nodes(const NodeValues& wanted, const NodeGraph& graph, double rate_weight);

// Throws Error{bad_input} naming `source` when the bytes end early or late or hold numbers too large. Takes memory for
// components * nodes: check the two before.
[[nodiscard]] NodeValues decode_nodes(std::span<const std::byte> bytes, int components, const NodeGraph& graph,
                                      const std::string& source);

}  // namespace kinespace
