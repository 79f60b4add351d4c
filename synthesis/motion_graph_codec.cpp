#include <algorithm>
#include <cmath>

#include "kinespace/synthesis/motion_graph.h"

namespace kinespace {
namespace {

// 1  first version
constexpr std::uint32_t graph_version = 1;
constexpr std::uint64_t most_graph_functions = 64, most_points = 4096;

}  // namespace

Bytes MotionGraph::pack() const {
  ByteWriter out;
  out.put(graph_version);
  out.put(static_cast<std::int32_t>(options_.connections));
  out.put(static_cast<std::int32_t>(options_.groups));
  out.put(static_cast<std::int32_t>(options_.neighbours));
  out.put(options_.largest_cost_cm);
  out.put(options_.connection.window_s);
  out.put(options_.connection.shortest_s);
  out.put(static_cast<std::int32_t>(options_.connection.functions));
  out.put(static_cast<std::uint64_t>(functions_.rows()));
  out.put(static_cast<std::uint64_t>(functions_.cols()));
  out.put_array(std::span(functions_.data(), static_cast<std::size_t>(functions_.size())));
  out.put(static_cast<std::uint64_t>(clips_.size()));
  out.put_array(std::span(clips_));
  out.put_array(std::span(durations_s_));
  out.put(static_cast<std::uint64_t>(templates_.size()));
  out.put_array(std::span(templates_));
  out.put(static_cast<std::uint64_t>(arrows_.size()));
  for (const GraphArrow& arrow : arrows_) {
    out.put(arrow.from);
    out.put(arrow.to);
    out.put(static_cast<std::uint8_t>(arrow.kind));
    out.put(arrow.cost_cm);
  }
  return std::move(out).take();
}

MotionGraph MotionGraph::unpack(std::span<const std::byte> bytes, const std::string& source) {
  ByteReader in(bytes, source);
  const auto version = in.get<std::uint32_t>();
  if (version != graph_version) {
    in.fail("a motion graph of version " + std::to_string(version), "version " + std::to_string(graph_version));
  }
  MotionGraph graph;
  graph.options_.connections = in.get<std::int32_t>();
  graph.options_.groups = in.get<std::int32_t>();
  graph.options_.neighbours = in.get<std::int32_t>();
  graph.options_.largest_cost_cm = in.get<double>();
  graph.options_.connection.window_s = in.get<double>();
  graph.options_.connection.shortest_s = in.get<double>();
  graph.options_.connection.functions = in.get<std::int32_t>();
  const auto points = in.get<std::uint64_t>(), functions = in.get<std::uint64_t>();
  if (points < 2 || points > most_points || functions < 1 || functions > most_graph_functions) {
    in.fail("a motion graph with functions of a size that cannot be", "a whole motion graph");
  }
  const auto values = in.get_array<double>(points * functions);
  graph.functions_ = Eigen::Map<const SampleMatrix>(values.data(), static_cast<Eigen::Index>(points),
                                                    static_cast<Eigen::Index>(functions));
  const auto clips = in.get<std::uint64_t>();
  graph.clips_ = in.get_array<std::int64_t>(clips);
  graph.durations_s_ = in.get_array<double>(clips);
  graph.templates_ = in.get_array<std::int64_t>(in.get<std::uint64_t>());
  const bool templates_known = std::ranges::all_of(
      graph.templates_, [&](std::int64_t id) { return std::ranges::binary_search(graph.clips_, id); });
  if (!templates_known || (graph.templates_.empty() && clips > 0)) {
    in.fail("a motion graph whose groups have no clips", "a whole motion graph");
  }
  const auto arrows = in.get<std::uint64_t>();
  for (std::uint64_t i = 0; i < arrows; ++i) {
    GraphArrow arrow{.from = in.get<std::int64_t>(), .to = in.get<std::int64_t>()};
    const auto kind = in.get<std::uint8_t>();
    arrow.kind = kind == 0 ? GraphArrow::Kind::connection : GraphArrow::Kind::neighbour;
    arrow.cost_cm = in.get<double>();
    const bool known =
        std::ranges::binary_search(graph.clips_, arrow.from) && std::ranges::binary_search(graph.clips_, arrow.to);
    if (kind > 1 || !known || !(arrow.cost_cm >= 0))
      in.fail("an arrow of the motion graph that cannot be", "arrows between its clips");
    graph.arrows_.push_back(arrow);
  }
  in.expect_end();
  const bool ordered = std::ranges::is_sorted(graph.clips_, std::less_equal<>{}) &&
                       std::ranges::is_sorted(graph.arrows_, {}, &GraphArrow::from) && graph.functions_.allFinite() &&
                       std::ranges::all_of(graph.durations_s_, [](double s) { return s >= 0 && std::isfinite(s); });
  if (!ordered) in.fail("a motion graph out of order", "clips and arrows in ascending order");
  return graph;
}

}  // namespace kinespace
