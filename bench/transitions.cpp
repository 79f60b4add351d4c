// `kinespace bench transitions`: connections against brute force and their cost, and the seams of transitions.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "bench/bench_library.h"
#include "bench/report.h"
#include "synthesis/connection.h"

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

void connection_rows(const std::string& data, LibraryView& view, BenchReport& report) {
  const MotionSpace& motions = view.space(view.library().spaces().front().id);
  const ConnectionSpace space(motions);
  const Ends ends = ends_of(view, space);
  const auto pairs = random_pairs(ends.rows.size(), 200);

  std::vector<std::optional<Connection>> found(pairs.size()), wanted(pairs.size());
  double seconds = 1e9;
  for (int round = 0; round < 3; ++round) {
    const auto start = Clock::now();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      found[i] = space.connect(ends.ends[pairs[i].first], ends.starts[pairs[i].second]);
    }
    seconds = std::min(seconds, std::chrono::duration<double>(Clock::now() - start).count());
  }
  tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t i) {
    wanted[i] = reference::connect(space, ends.ends[pairs[i].first], ends.starts[pairs[i].second], 65, 240);
  });
  int agreeing = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (found[i].has_value() != wanted[i].has_value()) continue;
    // The objective is E, the square of the cost.
    agreeing += !found[i] || std::pow(found[i]->cost_cm / wanted[i]->cost_cm, 2) <= 1.01 ? 1 : 0;
  }
  report.results.push_back({.name = "connections within 1 % of brute force", .data = data,
                            .value = 100.0 * agreeing / static_cast<double>(pairs.size()), .unit = "%", .bar = 99,
                            .higher_is_better = true});
  report.results.push_back({.name = "time of a connection, tables built, one core", .data = data,
                            .value = 1e3 * seconds / static_cast<double>(pairs.size()), .unit = "ms", .bar = 2});
}

}  // namespace

BenchReport bench_transitions(const BenchOptions& options) {
  BenchReport report{.bench = "transitions", .device = "processor", .threads = 1};
  BenchLibrary bandai({options.data / "bandai2"});
  connection_rows("bandai2", bandai.view(), report);
  BenchLibrary cmu({options.data / "cmu"});
  connection_rows("cmu", cmu.view(), report);
  return report;
}

}  // namespace kinespace
