// Connections that join groups of a motion graph which nothing leaves or nothing enters (motion_graph.h).
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "kinespace/synthesis/connection.h"

namespace kinespace {

struct GraphBridge {
  std::size_t from = 0, to = 0;
  double cost_cm = 0;
};

// For each node its strongly connected component: numbers from 0, in no particular order. `arrows`: from, to.
[[nodiscard]] std::vector<std::size_t> strong_components(std::size_t nodes,
                                                         std::span<const std::pair<std::size_t, std::size_t>> arrows);

// What to add to `arrows` so that every motion reaches every other, as far as connections of at most `largest_cost_cm`
// are found among the 16 whose mean poses are nearest, for each group that has none out or none in.
[[nodiscard]] std::vector<GraphBridge> graph_bridges(const ConnectionSpace& space,
                                                     std::span<const ConnectionMotion* const> ends,
                                                     std::span<const ConnectionMotion* const> starts,
                                                     std::vector<std::pair<std::size_t, std::size_t>> arrows,
                                                     double largest_cost_cm);

}  // namespace kinespace
