// The best connections out of every motion of a graph (motion_graph.h), found without trying all pairs.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "kinespace/synthesis/connection.h"

namespace kinespace {

// Motions as the search sees them; all spans and vectors have one entry a motion.
struct GraphMotions {
  std::vector<ConnectionMotion> starts, ends;
  std::vector<std::size_t> group;  // of similar motions
  std::vector<bool> fresh;         // pairs of two motions that are not are known already
  [[nodiscard]] std::size_t size() const { return starts.size(); }
};

struct GraphWay {
  double cost_cm = 0;
  std::size_t to = 0;
  auto operator<=>(const GraphWay&) const = default;
};

struct GraphWayLimits {
  std::size_t best = 4;         // ways kept wherever they lead ...
  double largest_cost_cm = 30;  // ... and one into every group; none costs more
  int group_tries = 4;
};

// The ways out of motion `from`, by cost: those in `known`, and what the motions that are fresh (or all, when `from`
// is) add. The best ways are exact: pairs are tried by their lower bounds until no other can be among them. The way
// into a group is the best of the `group_tries` of lowest bound, and of what else was tried. No way leads back to
// `from`.
[[nodiscard]] std::vector<GraphWay> best_ways(const ConnectionSpace& space, const ConnectionBounds& bounds,
                                              const GraphMotions& motions, std::size_t from,
                                              std::vector<GraphWay> known, const GraphWayLimits& limits);

}  // namespace kinespace
