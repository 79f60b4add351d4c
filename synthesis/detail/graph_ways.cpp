#include "kinespace/synthesis/detail/graph_ways.h"

#include <algorithm>
#include <limits>

namespace kinespace {
namespace {

// What is kept so far, and from which cost on a way is of no use.
class KeptWays {
 public:
  KeptWays(const GraphMotions& motions, const GraphWayLimits& limits)
      : motions_(motions), limits_(limits), of_group_(std::ranges::max(motions.group) + 1, none) {}

  // From which cost on a way is not among the best, and not the best into its group.
  [[nodiscard]] double limit() const {
    return best_.size() == limits_.best ? best_.back().cost_cm : limits_.largest_cost_cm;
  }
  [[nodiscard]] double group_limit(std::size_t to) const {
    return std::min(of_group_[motions_.group[to]].cost_cm, limits_.largest_cost_cm);
  }

  void offer(const GraphWay& way) {
    if (way.cost_cm > limits_.largest_cost_cm) return;
    GraphWay& of_group = of_group_[motions_.group[way.to]];
    of_group = std::min(of_group, way);
    best_.insert(std::ranges::lower_bound(best_, way), way);
    if (best_.size() > limits_.best) best_.pop_back();
  }

  [[nodiscard]] std::vector<GraphWay> take() && {
    for (const GraphWay& way : of_group_) {
      if (way.to != none.to && std::ranges::find(best_, way) == best_.end()) best_.push_back(way);
    }
    std::ranges::sort(best_);
    return std::move(best_);
  }

 private:
  static constexpr GraphWay none{std::numeric_limits<double>::infinity(), std::numeric_limits<std::size_t>::max()};
  const GraphMotions& motions_;
  const GraphWayLimits& limits_;
  std::vector<GraphWay> best_;
  std::vector<GraphWay> of_group_;
};

}  // namespace

std::vector<GraphWay> best_ways(const ConnectionSpace& space, const ConnectionBounds& bounds,
                                const GraphMotions& motions, std::size_t from, std::vector<GraphWay> known,
                                const GraphWayLimits& limits) {
  KeptWays kept(motions, limits);
  for (const GraphWay& way : known) kept.offer(way);
  std::vector<GraphWay> candidates;  // with their lower bounds
  for (std::size_t to = 0; to < motions.size(); ++to) {
    if (to == from || !(motions.fresh[from] || motions.fresh[to])) continue;
    const double bound = bounds.cm(from, to);
    if (bound <= limits.largest_cost_cm) candidates.push_back({bound, to});
  }
  std::ranges::sort(candidates);
  std::vector<int> tries(std::ranges::max(motions.group) + 1, limits.group_tries);
  for (const GraphWay& candidate : candidates) {
    const bool for_group =
        tries[motions.group[candidate.to]] > 0 && candidate.cost_cm <= kept.group_limit(candidate.to);
    if (!for_group && candidate.cost_cm > kept.limit()) continue;
    --tries[motions.group[candidate.to]];
    const double limit = for_group ? std::max(kept.limit(), kept.group_limit(candidate.to)) : kept.limit();
    const auto connection = space.connect(motions.ends[from], motions.starts[candidate.to], 0, {.give_up_cm = limit});
    if (connection) kept.offer({connection->cost_cm, candidate.to});
  }
  return std::move(kept).take();
}

}  // namespace kinespace
