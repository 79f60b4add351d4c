#include "kinespace/synthesis/detail/graph_bridges.h"

#include <algorithm>
#include <optional>
#include <tuple>

#include "kinespace/base/parallel.h"

namespace kinespace {
namespace {

constexpr std::size_t tries = 16;

using Arrows = std::span<const std::pair<std::size_t, std::size_t>>;

std::vector<std::vector<std::size_t>> lists_of(std::size_t nodes, Arrows arrows, bool backwards) {
  std::vector<std::vector<std::size_t>> out(nodes);
  for (const auto& [from, to] : arrows) out[backwards ? to : from].push_back(backwards ? from : to);
  return out;
}

// Nodes in the order in which a depth-first walk leaves them.
std::vector<std::size_t> leaving_order(const std::vector<std::vector<std::size_t>>& next) {
  std::vector<std::size_t> order;
  std::vector<bool> seen(next.size());
  std::vector<std::pair<std::size_t, std::size_t>> stack;  // node, how many of its arrows are done
  for (std::size_t root = 0; root < next.size(); ++root) {
    if (seen[root]) continue;
    seen[root] = true;
    stack.emplace_back(root, 0);
    while (!stack.empty()) {
      const std::size_t node = stack.back().first;
      if (stack.back().second == next[node].size()) {
        order.push_back(node);
        stack.pop_back();
        continue;
      }
      const std::size_t to = next[node][stack.back().second++];
      if (seen[to]) continue;
      seen[to] = true;
      stack.emplace_back(to, 0);
    }
  }
  return order;
}

Eigen::MatrixXf mean_poses(std::span<const ConnectionMotion* const> motions) {
  Eigen::MatrixXf out(static_cast<Eigen::Index>(motions.size()), motions[0]->poses.cols());
  for (std::size_t i = 0; i < motions.size(); ++i)
    out.row(static_cast<Eigen::Index>(i)) = motions[i]->poses.colwise().mean();
  return out;
}

// The pairs of a motion in the group and one outside whose poses are nearest: out of the group, or into it.
std::vector<std::pair<std::size_t, std::size_t>> nearest_pairs(const Eigen::MatrixXf& ends,
                                                               const Eigen::MatrixXf& starts,
                                                               const std::vector<std::size_t>& component,
                                                               std::size_t group, bool out) {
  std::vector<std::tuple<float, std::size_t, std::size_t>> found;
  const Eigen::MatrixXf& others = out ? starts : ends;
  for (std::size_t i = 0; i < component.size(); ++i) {
    if (component[i] != group) continue;
    const auto own = (out ? ends : starts).row(static_cast<Eigen::Index>(i));
    const Eigen::VectorXf distance = (others.rowwise() - own).rowwise().squaredNorm();
    for (std::size_t k = 0; k < component.size(); ++k) {
      if (component[k] == group) continue;
      found.emplace_back(distance(static_cast<Eigen::Index>(k)), out ? i : k, out ? k : i);
    }
    const auto keep = std::min(tries, found.size());
    std::ranges::partial_sort(found, found.begin() + static_cast<std::ptrdiff_t>(keep));
    found.resize(keep);
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const auto& [distance, from, to] : found) pairs.emplace_back(from, to);
  return pairs;
}

}  // namespace

std::vector<std::size_t> strong_components(std::size_t nodes, Arrows arrows) {
  // Kosaraju: backwards from the nodes that are left last.
  const auto order = leaving_order(lists_of(nodes, arrows, false));
  const auto back = lists_of(nodes, arrows, true);
  std::vector<std::size_t> component(nodes, nodes);
  std::size_t count = 0;
  for (auto root = order.rbegin(); root != order.rend(); ++root) {
    if (component[*root] != nodes) continue;
    std::vector<std::size_t> stack{*root};
    component[*root] = count;
    while (!stack.empty()) {
      const std::size_t node = stack.back();
      stack.pop_back();
      for (const std::size_t to : back[node]) {
        if (component[to] != nodes) continue;
        component[to] = count;
        stack.push_back(to);
      }
    }
    ++count;
  }
  return component;
}

std::vector<GraphBridge> graph_bridges(const ConnectionSpace& space, std::span<const ConnectionMotion* const> ends,
                                       std::span<const ConnectionMotion* const> starts,
                                       std::vector<std::pair<std::size_t, std::size_t>> arrows,
                                       double largest_cost_cm) {
  std::vector<GraphBridge> out;
  if (ends.empty()) return out;
  const Eigen::MatrixXf end_poses = mean_poses(ends), start_poses = mean_poses(starts);
  for (bool grown = true; grown;) {
    grown = false;
    const auto component = strong_components(ends.size(), arrows);
    const std::size_t groups = std::ranges::max(component) + 1;
    if (groups == 1) break;
    std::vector<bool> has_out(groups), has_in(groups);
    for (const auto& [from, to] : arrows) {
      if (component[from] == component[to]) continue;
      has_out[component[from]] = true;
      has_in[component[to]] = true;
    }
    std::vector<std::optional<GraphBridge>> found(2 * groups);
    parallel_for(std::size_t{0}, 2 * groups, [&](std::size_t i) {
      const std::size_t group = i / 2;
      const bool leaving = i % 2 == 0;
      if (leaving ? has_out[group] : has_in[group]) return;
      for (const auto& [from, to] : nearest_pairs(end_poses, start_poses, component, group, leaving)) {
        const auto connection = space.connect(*ends[from], *starts[to]);
        if (!connection || connection->cost_cm > largest_cost_cm) continue;
        if (!found[i] || connection->cost_cm < found[i]->cost_cm) found[i] = {from, to, connection->cost_cm};
      }
    });
    for (const auto& bridge : found) {
      if (!bridge || std::ranges::find(arrows, std::pair(bridge->from, bridge->to)) != arrows.end()) continue;
      arrows.emplace_back(bridge->from, bridge->to);
      out.push_back(*bridge);
      grown = true;
    }
  }
  return out;
}

}  // namespace kinespace
