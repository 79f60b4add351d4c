// `kinespace bench transitions`: connections against brute force and their cost, and the seams of transitions.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include "bench/bench_library.h"
#include "bench/report.h"
#include "bench/seams.h"
#include "kinespace/base/parallel.h"
#include "kinespace/licence.h"
#include "kinespace/synthesis/connection.h"
#include "kinespace/synthesis/motion_graph.h"
#include "kinespace/synthesis/transition_plan.h"
#if KINESPACE_ALGLIB
#include "kinespace/alglib/minimum.h"
#endif

namespace kinespace {
namespace {

using Clock = std::chrono::steady_clock;

struct Ends {
  std::vector<ClipRow> rows;
  std::vector<ConnectionMotion> starts, ends;
};

Ends ends_of(LibraryView& view, const ConnectionSpace& space) {
  Ends out;
  for (const ClipRow& row : view.library().clips()) {
    if (!space.long_enough(static_cast<double>(row.frames - 1) / row.rate_hz)) continue;
    const ClipCurves curves = view.curves(row);
    out.rows.push_back(row);
    out.starts.push_back(space.start_of(curves));
    out.ends.push_back(space.end_of(curves));
  }
  return out;
}

std::vector<std::pair<std::size_t, std::size_t>> random_pairs(std::size_t clips, int count) {
  std::mt19937_64 random(2026);
  std::vector<std::pair<std::size_t, std::size_t>> out;
  while (out.size() < static_cast<std::size_t>(count)) {
    out.emplace_back(random() % clips, random() % clips);
  }
  return out;
}

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

// Connections of the pairs by one minimiser.
struct Refined {
  std::vector<std::optional<Connection>> found;
  double seconds = 1e9;  // for all pairs, the fastest of three
  double cost = 0;       // E in square metres, the mean over the pairs that have a connection
  double evaluations = 0;
};

Refined refine_pairs(const RegisteredSpace& motions, const Ends& ends, const Pairs& pairs, BoxMinimiser minimiser) {
  const ConnectionSpace space(motions, {.minimiser = minimiser});
  Refined out{.found = std::vector<std::optional<Connection>>(pairs.size())};
  for (int round = 0; round < 3; ++round) {
    const auto start = Clock::now();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      out.found[i] = space.connect(ends.ends[pairs[i].first], ends.starts[pairs[i].second]);
    }
    out.seconds = std::min(out.seconds, std::chrono::duration<double>(Clock::now() - start).count());
  }
  double count = 0;
  for (const auto& connection : out.found) {
    if (!connection) continue;
    ++count;
    out.cost += std::pow(connection->cost_cm / 100, 2);
    out.evaluations += connection->evaluations;
  }
  out.cost /= std::max(1.0, count);
  out.evaluations /= std::max(1.0, count);
  return out;
}

void minimiser_rows(const std::string& data, const std::string& name, const Refined& refined, BenchReport& report) {
  report.results.push_back({.name = "E of connections refined by " + name + ", mean",
                            .data = data,
                            .value = 1e4 * refined.cost,
                            .unit = "cm^2"});
  report.results.push_back(
      {.name = "evaluations of E for a connection by " + name + ", mean", .data = data, .value = refined.evaluations});
}

#if KINESPACE_ALGLIB
void alglib_rows(const std::string& data, const RegisteredSpace& motions, const Ends& ends, const Pairs& pairs,
                 const Refined& ours, BenchReport& report) {
  const Refined theirs = refine_pairs(motions, ends, pairs, alglib_minimise_in_box);
  minimiser_rows(data, "ALGLIB", theirs, report);
  double largest = 0;
  int better = 0, worse = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!ours.found[i] || !theirs.found[i]) continue;
    const double ratio = std::pow(ours.found[i]->cost_cm / theirs.found[i]->cost_cm, 2) - 1;
    largest = std::max(largest, std::abs(ratio));
    better += ratio < -1e-9 ? 1 : 0;
    worse += ratio > 1e-9 ? 1 : 0;
  }
  report.results.push_back(
      {.name = "largest difference of E, ours from ALGLIB's", .data = data, .value = 100 * largest, .unit = "%"});
  report.results.push_back({.name = "connections where ours is lower by more than 1e-9",
                            .data = data,
                            .value = static_cast<double>(better)});
  report.results.push_back({.name = "connections where ours is higher by more than 1e-9",
                            .data = data,
                            .value = static_cast<double>(worse)});
  report.results.push_back({.name = "time of a connection refined by ALGLIB, one core",
                            .data = data,
                            .value = 1e3 * theirs.seconds / static_cast<double>(pairs.size()),
                            .unit = "ms"});
}
#endif

void connection_rows(const std::string& data, LibraryView& view, BenchReport& report) {
  const RegisteredSpace& motions = view.space(view.library().spaces().front().id);
  const ConnectionSpace space(motions);
  const Ends ends = ends_of(view, space);
  const Pairs pairs = random_pairs(ends.rows.size(), 200);

  const Refined ours = refine_pairs(motions, ends, pairs, minimise_in_box);
  const auto& found = ours.found;
  std::vector<std::optional<Connection>> wanted(pairs.size());
  parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t i) {
    wanted[i] = reference::connect(space, ends.ends[pairs[i].first], ends.starts[pairs[i].second], 49, 160);
  });
  int agreeing = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (found[i].has_value() != wanted[i].has_value()) continue;
    // The objective is E, the square of the cost.
    agreeing += !found[i] || std::pow(found[i]->cost_cm / wanted[i]->cost_cm, 2) <= 1.01 ? 1 : 0;
  }
  report.results.push_back({.name = "connections within 1 % of brute force",
                            .data = data,
                            .value = 100.0 * agreeing / static_cast<double>(pairs.size()),
                            .unit = "%",
                            .bar = 99,
                            .higher_is_better = true});
  report.results.push_back({.name = "time of a connection, tables built, one core",
                            .data = data,
                            .value = 1e3 * ours.seconds / static_cast<double>(pairs.size()),
                            .unit = "ms",
                            .bar = 2});
  minimiser_rows(data, "projected BFGS", ours, report);
#if KINESPACE_ALGLIB
  alglib_rows(data, motions, ends, pairs, ours, report);
#endif
}

// Every pair of clips, those skipped that the lower bound rules out.
void graph_rows(const std::string& data, LibraryView& view, BenchReport& report) {
  const auto start = Clock::now();
  const MotionGraph graph = MotionGraph::make(view, view.library().spaces().front().id, {});
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  const auto clips = static_cast<double>(graph.clips().size());
  report.results.push_back({.name = "graph of all clips, for 1000 clips (by the number of pairs), 2 threads",
                            .data = data,
                            .value = seconds / 60 * (1000 / clips) * (1000 / clips),
                            .unit = "min",
                            .bar = 20});
  const auto pairs = random_pairs(graph.clips().size(), 500);
  int without = 0;
  double played = 0;
  for (const auto& [from, to] : pairs) {
    const auto path = graph.path(graph.clips()[from], graph.clips()[to]);
    without += path ? 0 : 1;
    played += path ? static_cast<double>(path->clips.size()) : 0;
  }
  report.results.push_back({.name = "pairs without a way through the graph",
                            .data = data,
                            .value = 100.0 * without / static_cast<double>(pairs.size()),
                            .unit = "%"});
  report.results.push_back({.name = "clips played on the way, mean",
                            .data = data,
                            .value = played / static_cast<double>(pairs.size()),
                            .unit = "clips"});
}

double median_of(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + std::ssize(values) / 2);
  return values[values.size() / 2];
}

// The same through the graph, which the first pair makes and keeps in the bench's library.
void path_rows(const std::string& data, LibraryView& view, BenchReport& report) {
  const auto rows = view.library().clips();
  std::vector<double> ratios;
  for (const auto& [first, second] : random_pairs(rows.size(), 60)) {
    const std::vector<std::string> names{rows[first].name, rows[second].name};
    const auto plan = plan_transition(view, names, {.via_graph = true});
    if (!plan) continue;
    for (const Join& join : plan->transition.joins) ratios.push_back(join.ratios.worst());
  }
  report.results.push_back({.name = "seam: speed or acceleration, median of the seams of 60 ways through the graph",
                            .data = data,
                            .value = median_of(ratios),
                            .unit = "x",
                            .bar = 1});
  report.results.push_back(
      {.name = "seam: the same, worst", .data = data, .value = std::ranges::max(ratios), .unit = "x", .bar = 2});
}

}  // namespace

BenchReport bench_transitions(const BenchOptions& options) {
  BenchReport report{.bench = "transitions", .device = "processor", .threads = tbb::this_task_arena::max_concurrency()};
  if (!options.clips.empty()) {
    BenchLibrary given(options.clips);
    seam_rows("clips", given.view(), report);
    return report;
  }
  BenchLibrary bandai({options.data / "bandai2"});
  connection_rows("bandai2", bandai.view(), report);
  seam_rows("bandai2", bandai.view(), report);
  graph_rows("bandai2", bandai.view(), report);
  path_rows("bandai2", bandai.view(), report);
  BenchLibrary cmu({options.data / "cmu"});
  connection_rows("cmu", cmu.view(), report);
  path_rows("cmu", cmu.view(), report);
  BenchLibrary walks({options.data / "cmu" / "02", options.data / "cmu" / "03"});
  seam_rows("cmu 02, 03", walks.view(), report);
  for (const char* folder : {"hips15", "xia31"}) {
    BenchLibrary foreign({options.data / "foreign" / folder});
    seam_rows(std::string("foreign/") + folder, foreign.view(), report);
  }
  return report;
}

}  // namespace kinespace
