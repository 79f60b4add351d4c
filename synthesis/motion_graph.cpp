#include "kinespace/synthesis/motion_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/fpca/alignment.h"
#include "kinespace/synthesis/detail/graph_bridges.h"
#include "kinespace/synthesis/detail/graph_ways.h"
#include "kinespace/synthesis/interpolation.h"

namespace kinespace {
namespace {

constexpr const char* artifact_kind = "motion graph";
constexpr double second_cost_cm = 0.5;
constexpr std::size_t clip_block = 32;  // clips that are taken in between two looks at the progress

// Runs in parallel over all motions, in blocks, and tells how far it is.
template <typename Work>
void over_all(std::size_t count, const char* stage, const Progress& progress, const Work& work) {
  for (std::size_t begin = 0; begin < count; begin += clip_block) {
    progress.check_stop();
    progress.at(stage, static_cast<double>(begin) / static_cast<double>(count));
    parallel_for(begin, std::min(begin + clip_block, count), work);
  }
  progress.at(stage, 1);
}

// For each clip of the matrix its nearest others, by exact distance.
std::vector<std::vector<std::size_t>> nearest_rows(const RetrievalMatrix& matrix, int neighbours) {
  const auto count = static_cast<Eigen::Index>(matrix.clip_ids.size());
  const Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> all(
      matrix.values.data(), count, static_cast<Eigen::Index>(matrix.dimensions));
  std::vector<std::vector<std::size_t>> out(matrix.clip_ids.size());
  parallel_for(Eigen::Index{0}, count, [&](Eigen::Index i) {
    const Eigen::VectorXf distance = (all.rowwise() - all.row(i)).rowwise().squaredNorm();
    std::vector<std::size_t> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::erase(order, static_cast<std::size_t>(i));
    const auto keep = std::min(order.size(), static_cast<std::size_t>(neighbours));
    std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(keep), {},
                              [&](std::size_t k) { return std::pair(distance(static_cast<Eigen::Index>(k)), k); });
    order.resize(keep);
    out[static_cast<std::size_t>(i)] = std::move(order);
  });
  return out;
}

// For each clip of the graph its group of similar clips: that of the nearest of the templates.
std::vector<std::size_t> nearest_templates(const RetrievalMatrix& matrix, std::span<const std::int64_t> clips,
                                           std::span<const std::int64_t> templates) {
  const auto row_of = [&](std::int64_t id) {
    const auto row = std::ranges::lower_bound(matrix.clip_ids, id) - matrix.clip_ids.begin();
    return Eigen::Map<const Eigen::VectorXf>(
        matrix.values.data() + row * static_cast<std::ptrdiff_t>(matrix.dimensions),
        static_cast<Eigen::Index>(matrix.dimensions));
  };
  std::vector<std::size_t> out;
  for (const std::int64_t clip : clips) {
    std::size_t best = 0;
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t t = 0; t < templates.size(); ++t) {
      const float distance = (row_of(clip) - row_of(templates[t])).squaredNorm();
      if (distance < least) {
        least = distance;
        best = t;
      }
    }
    out.push_back(best);
  }
  return out;
}

// Clips spread over all clips: farthest first.
std::vector<std::int64_t> spread_templates(const RetrievalMatrix& matrix, std::span<const std::int64_t> clips,
                                           int count) {
  Eigen::MatrixXf vectors(static_cast<Eigen::Index>(clips.size()), static_cast<Eigen::Index>(matrix.dimensions));
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const auto row = std::ranges::lower_bound(matrix.clip_ids, clips[i]) - matrix.clip_ids.begin();
    vectors.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::RowVectorXf>(
        matrix.values.data() + row * static_cast<std::ptrdiff_t>(matrix.dimensions), vectors.cols());
  }
  std::vector<std::int64_t> out;
  for (const int t : group_sequences(vectors, count).templates) out.push_back(clips[static_cast<std::size_t>(t)]);
  return out;
}

bool before(const GraphArrow& a, const GraphArrow& b) {
  return std::tuple(a.from, a.to, a.kind) < std::tuple(b.from, b.to, b.kind);
}

}  // namespace

void MotionGraphOptions::validate() const {
  const auto fail = [](const std::string& found, const char* expected) {
    throw Error(ErrorKind::usage, {.found = found, .expected = expected});
  };
  if (connections < 1 || connections > 1000) fail(fmt::format("connections = {}", connections), "from 1 to 1000");
  if (groups < 1 || groups > 1000) fail(fmt::format("groups = {}", groups), "from 1 to 1000");
  if (neighbours < 0 || neighbours > 1000) fail(fmt::format("neighbours = {}", neighbours), "from 0 to 1000");
  if (!(largest_cost_cm > 0)) fail(fmt::format("largest_cost_cm = {}", largest_cost_cm), "above 0");
  connection.validate();
}

MotionGraph MotionGraph::make(LibraryView& library, std::int64_t space_id, const MotionGraphOptions& options,
                              const Progress& progress) {
  options.validate();
  const RegisteredSpace& space = library.space(space_id);
  MotionGraph graph;
  graph.options_ = options;
  graph.key_ = space.skeleton().tree_hash();
  graph.functions_ = ConnectionSpace(space, options.connection).functions();
  graph.take_in(library, space_id, progress);
  return graph;
}

MotionGraph MotionGraph::of(LibraryView& library, std::int64_t space_id, const MotionGraphOptions& options,
                            const Progress& progress, bool* changed) {
  options.validate();
  if (changed) *changed = true;
  const std::string key = library.space(space_id).skeleton().tree_hash();
  const auto kept = library.library().artifact(artifact_kind, key);
  if (!kept) return make(library, space_id, options, progress);
  MotionGraph graph = unpack(*kept, library.library().path().string());
  graph.key_ = key;
  const MotionGraphOptions& had = graph.options_;
  const bool same = had.connections == options.connections && had.groups == options.groups &&
                    had.neighbours == options.neighbours && had.largest_cost_cm == options.largest_cost_cm &&
                    had.connection.window_s == options.connection.window_s &&
                    had.connection.shortest_s == options.connection.shortest_s &&
                    had.connection.functions == options.connection.functions;
  std::set<std::int64_t> present;
  for (const ClipRow& row : library.library().clips()) {
    if (row.space_id == space_id) present.insert(row.id);
  }
  const bool gone = std::ranges::any_of(graph.clips_, [&](std::int64_t id) { return !present.contains(id); });
  if (!same || gone) return make(library, space_id, options, progress);
  const std::size_t clips = graph.clips_.size();
  graph.take_in(library, space_id, progress);
  if (changed) *changed = graph.clips_.size() != clips;
  return graph;
}

void MotionGraph::save(Library& library) const {
  library.put_artifact(artifact_kind, key_, pack());
}

void MotionGraph::take_in(LibraryView& library, std::int64_t space_id, const Progress& progress) {
  const std::set<std::int64_t> had(clips_.begin(), clips_.end());
  std::vector<ClipRow> rows;
  bool any = false;
  const ConnectionSpace space(library.space(space_id), functions_, options_.connection);
  for (const ClipRow& row : library.library().clips()) {
    if (row.space_id != space_id || !space.long_enough(static_cast<double>(row.frames - 1) / row.rate_hz)) continue;
    any = any || !had.contains(row.id);
    rows.push_back(row);
  }
  if (!any) return;

  GraphMotions motions;
  std::map<std::int64_t, std::size_t> index;
  clips_.clear();
  durations_s_.clear();
  for (const ClipRow& row : rows) {
    progress.check_stop();
    progress.at("reading motions", static_cast<double>(motions.size()) / static_cast<double>(rows.size()));
    const ClipCurves curves = library.curves(row);
    index[row.id] = motions.size();
    motions.starts.push_back(space.start_of(curves));
    motions.ends.push_back(space.end_of(curves));
    motions.fresh.push_back(!had.contains(row.id));
    clips_.push_back(row.id);
    durations_s_.push_back(static_cast<double>(row.frames - 1) / row.rate_hz);
  }
  const RetrievalMatrix matrix = library.library().retrieval_matrix(space_id);
  if (templates_.empty()) templates_ = spread_templates(matrix, clips_, options_.groups);
  motions.group = nearest_templates(matrix, clips_, templates_);

  std::vector<const ConnectionMotion*> ends, starts;
  for (const ConnectionMotion& motion : motions.ends) ends.push_back(&motion);
  for (const ConnectionMotion& motion : motions.starts) starts.push_back(&motion);
  const ConnectionBounds bounds(options_.connection, ends, starts);
  std::vector<std::vector<GraphWay>> ways(motions.size());
  for (const GraphArrow& arrow : arrows_) {
    if (arrow.kind == GraphArrow::Kind::connection) {
      ways[index.at(arrow.from)].push_back({arrow.cost_cm, index.at(arrow.to)});
    }
  }
  const GraphWayLimits limits{static_cast<std::size_t>(options_.connections), options_.largest_cost_cm};
  over_all(motions.size(), "connecting motions", progress,
           [&](std::size_t i) { ways[i] = best_ways(space, bounds, motions, i, std::move(ways[i]), limits); });
  std::map<std::pair<std::int64_t, std::int64_t>, double> connections;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    for (const GraphWay& way : ways[i]) connections[{clips_[i], clips_[way.to]}] = way.cost_cm;
  }

  // Neighbours: which they are is cheap to find; how far apart they are is kept from before where it is known.
  std::map<std::pair<std::int64_t, std::int64_t>, double> known;
  for (const GraphArrow& arrow : arrows_) {
    if (arrow.kind == GraphArrow::Kind::neighbour) known[{arrow.from, arrow.to}] = arrow.cost_cm;
  }
  const auto nearest = nearest_rows(matrix, options_.neighbours);
  std::set<std::pair<std::int64_t, std::int64_t>> pairs;
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    for (const std::size_t k : nearest[i]) {
      const auto a = matrix.clip_ids[i], b = matrix.clip_ids[k];
      if (index.contains(a) && index.contains(b)) pairs.insert(std::minmax(a, b));
    }
  }
  arrows_.clear();
  for (const auto& [way, cost] : connections) {
    arrows_.push_back({way.first, way.second, GraphArrow::Kind::connection, cost});
  }
  std::size_t done = 0;
  for (const auto& [a, b] : pairs) {
    if (done % clip_block == 0) {
      progress.check_stop();
      progress.at("comparing neighbours", static_cast<double>(done) / static_cast<double>(pairs.size()));
    }
    ++done;
    const auto kept = known.find({a, b});
    const ClipRow& row = rows[index.at(a)];
    const double cost = kept != known.end() ? kept->second
                                            : motion_distance_cm(library.curves(row), library.curves(rows[index.at(b)]),
                                                                 library.skeleton(row.skeleton_id));
    if (cost > options_.largest_cost_cm) continue;
    arrows_.push_back({a, b, GraphArrow::Kind::neighbour, cost});
    arrows_.push_back({b, a, GraphArrow::Kind::neighbour, cost});
  }
  std::vector<std::pair<std::size_t, std::size_t>> joined;
  for (const GraphArrow& arrow : arrows_) joined.emplace_back(index.at(arrow.from), index.at(arrow.to));
  progress.at("joining groups", 0);
  for (const GraphBridge& bridge : graph_bridges(space, ends, starts, std::move(joined), options_.largest_cost_cm)) {
    arrows_.push_back({clips_[bridge.from], clips_[bridge.to], GraphArrow::Kind::connection, bridge.cost_cm});
  }
  std::ranges::sort(arrows_, before);
}

std::optional<GraphPath> MotionGraph::path(std::int64_t from, std::int64_t to) const {
  const auto place = [&](std::int64_t id) { return std::ranges::lower_bound(clips_, id) - clips_.begin(); };
  const auto holds = [&](std::int64_t id) { return std::ranges::binary_search(clips_, id); };
  if (!holds(from) || !holds(to)) return std::nullopt;
  if (from == to) return GraphPath{.clips = {from}};
  constexpr double infinite = std::numeric_limits<double>::infinity();
  std::vector<double> cost(clips_.size(), infinite);
  std::vector<const GraphArrow*> by(clips_.size(), nullptr);
  using Entry = std::pair<double, std::int64_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost[static_cast<std::size_t>(place(from))] = 0;
  open.emplace(0, from);
  while (!open.empty()) {
    const auto [so_far, clip] = open.top();
    open.pop();
    const auto here = static_cast<std::size_t>(place(clip));
    if (so_far > cost[here]) continue;
    if (clip == to) break;
    const double playing = clip == from ? 0 : second_cost_cm * durations_s_[here];
    for (auto arrow = std::ranges::lower_bound(arrows_, clip, {}, &GraphArrow::from);
         arrow != arrows_.end() && arrow->from == clip; ++arrow) {
      const double next = so_far + playing + weight_of(arrow->cost_cm);
      const auto there = static_cast<std::size_t>(place(arrow->to));
      if (next >= cost[there]) continue;
      cost[there] = next;
      by[there] = &*arrow;
      open.emplace(next, arrow->to);
    }
  }
  if (cost[static_cast<std::size_t>(place(to))] == infinite) return std::nullopt;
  GraphPath out{.clips = {to}, .weight = cost[static_cast<std::size_t>(place(to))]};
  while (out.clips.back() != from) {
    const GraphArrow* arrow = by[static_cast<std::size_t>(place(out.clips.back()))];
    out.kinds.push_back(arrow->kind);
    out.cost_cm += arrow->cost_cm;
    out.clips.push_back(arrow->from);
  }
  std::ranges::reverse(out.clips);
  std::ranges::reverse(out.kinds);
  return out;
}

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
