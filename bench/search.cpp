// `kinespace bench search`: exact nearest windows among all 1 s windows of bandai2, one query at a time on one core,
// beside nanoflann and a plain vectorised scan of the same vectors in the same run. The queries are windows of every
// 7th clip, which is not searched.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <nanoflann.hpp>

#include "bench/report.h"
#include "kinespace/base/parallel.h"
#include "kinespace/kernels/simd.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"
#include "kinespace/synthesis/vector_search.h"
#include "kinespace/synthesis/window_space.h"

namespace kinespace {
namespace {

constexpr int neighbours = 10;
constexpr int held_out = 7;  // every so many clips
constexpr int queries = 200;

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Windows {
  RowMatrix<float> searched;
  RowMatrix<float> queries;  // spread over those of the held-out clips
};

RowMatrix<float> all_vectors(const WindowSpace& space, const std::vector<WindowSamples>& stretches) {
  std::vector<Eigen::Index> starts{0};
  for (const WindowSamples& s : stretches) starts.push_back(starts.back() + space.windows(s.rows()));
  RowMatrix<float> out(starts.back(), space.dimensions());
  parallel_for(std::size_t{0}, stretches.size(), [&](std::size_t i) {
    out.middleRows(starts[i], starts[i + 1] - starts[i]) = space.vectors(stretches[i]);
  });
  return out;
}

Windows load_windows(const std::filesystem::path& folder, const WindowOptions& options) {
  const auto files = find_motion_files({folder});
  std::vector<PreparedClip> clips(files.size());
  parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) { clips[i] = prepare(read_clip(files[i])); });
  OrientationMoments orientations(curve_layout(clips.front().skeleton).joint_count());
  std::vector<WindowSamples> searched;
  std::vector<WindowSamples> held;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const ClipCurves& curves = clips[i].curves;
    orientations.add(curves.values);
    for (const Run& run : clips[i].runs) {
      const int first = run.cuts.front();
      (i % held_out == 3 ? held : searched)
          .push_back(window_samples(curves, first, run.cuts.back(), first / curves.rate_hz, options));
    }
  }
  const WindowSpace space = WindowSpace::fit(searched, clips.front().skeleton, orientations.references(), options);
  Windows out{.searched = all_vectors(space, searched), .queries = {}};
  const RowMatrix<float> others = all_vectors(space, held);
  out.queries.resize(queries, others.cols());
  for (Eigen::Index q = 0; q < queries; ++q) out.queries.row(q) = others.row(q * others.rows() / queries);
  return out;
}

std::span<const float> query_of(const Windows& windows, int q) {
  return {windows.queries.row(q).data(), static_cast<std::size_t>(windows.queries.cols())};
}

// Plain vectorised scan: sixteen sums along each row, the k best kept.
KINESPACE_SIMD_BODY float plain_distance_body(const float* a, const float* b, std::ptrdiff_t n) {
  float sums[16] = {};
  std::ptrdiff_t d = 0;
  for (; d + 16 <= n; d += 16) {
    for (std::ptrdiff_t l = 0; l < 16; ++l) {
      const float x = a[d + l] - b[d + l];
      sums[l] += x * x;
    }
  }
  float sum = 0;
  for (; d < n; ++d) sum += (a[d] - b[d]) * (a[d] - b[d]);
  for (const float s : sums) sum += s;
  return sum;
}
KINESPACE_SIMD(plain_distance, float, (const float* a, const float* b, std::ptrdiff_t n), (a, b, n))

void scan(const Windows& windows, int q, std::vector<std::pair<float, std::int64_t>>& heap) {
  heap.clear();
  const float* query = windows.queries.row(q).data();
  for (Eigen::Index i = 0; i < windows.searched.rows(); ++i) {
    const float d = plain_distance(windows.searched.row(i).data(), query, windows.searched.cols());
    if (heap.size() == neighbours) {
      if (d >= heap.front().first) continue;
      std::ranges::pop_heap(heap);
      heap.pop_back();
    }
    heap.emplace_back(d, i);
    std::ranges::push_heap(heap);
  }
}

// What nanoflann asks of a set of points.
struct SearchPoints {
  const RowMatrix<float>& rows;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(rows.rows()); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t d) const {
    return rows(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(d));
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};
using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Adaptor<float, SearchPoints>, SearchPoints, -1, std::int64_t>;

void search_tree(const Tree& tree, const Windows& windows, int q) {
  std::vector<std::int64_t> ids(neighbours);
  std::vector<float> distances(neighbours);
  nanoflann::KNNResultSet<float, std::int64_t> result(neighbours);
  result.init(ids.data(), distances.data());
  tree.findNeighbors(result, windows.queries.row(q).data(), nanoflann::SearchParams(10));
}

// Mean seconds a query, the least of `rounds`.
double time_queries(int rounds, const std::function<void(int)>& query) {
  double least = 1e9;
  for (int round = 0; round < rounds; ++round) {
    least = std::min(least, seconds_of([&] {
                       for (int q = 0; q < queries; ++q) query(q);
                     }));
  }
  return least / queries;
}

int different_lists(const Windows& windows, const VectorSearch& search) {
  std::vector<int> different(queries, 0);
  parallel_for(0, queries, [&](int q) {
    const auto found = search.nearest(query_of(windows, q), neighbours);
    const auto wanted = reference::nearest(windows.searched, query_of(windows, q), neighbours);
    different[static_cast<std::size_t>(q)] = found == wanted ? 0 : 1;
  });
  return std::accumulate(different.begin(), different.end(), 0);
}

}  // namespace

BenchReport bench_search(const BenchOptions& options) {
  const Windows windows = load_windows(options.data / "bandai2", {});
  BenchReport report{.bench = "search", .device = "cpu", .threads = 1, .results = {}};
  const std::string data = "bandai2, every 7th clip held out";
  const auto add = [&](const std::string& name, double value, const std::string& unit,
                       std::optional<double> bar = std::nullopt, bool higher = false) {
    report.results.push_back(
        {.name = name, .data = data, .value = value, .unit = unit, .bar = bar, .higher_is_better = higher});
  };
  add("windows of 1 s at stride 1", static_cast<double>(windows.searched.rows()), "windows");
  add("dimensions", static_cast<double>(windows.searched.cols()), "");

  const SearchPoints points{windows.searched};
  Tree tree(static_cast<int>(windows.searched.cols()), points, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  add("nanoflann, build", seconds_of([&] { tree.buildIndex(); }), "s");
  const auto start = std::chrono::steady_clock::now();
  const VectorSearch search(windows.searched, {.rotate = false});
  add("build", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), "s");

  VectorSearch::Scratch scratch;
  std::vector<std::pair<float, std::int64_t>> heap;
  const double ours = time_queries(5, [&](int q) { search.nearest(query_of(windows, q), neighbours, scratch); });
  const double flann = time_queries(3, [&](int q) { search_tree(tree, windows, q); });
  const double plain = time_queries(2, [&](int q) { scan(windows, q, heap); });
  add("k = 10, a query", ours * 1e3, "ms");
  add("k = 10, a query by nanoflann", flann * 1e3, "ms");
  add("k = 10, a query by a plain vectorised scan", plain * 1e3, "ms");
  add("times as fast as nanoflann", flann / ours, "x", 3, true);
  add("times as fast as a plain vectorised scan", plain / ours, "x", 12, true);
  add("lists that differ from comparing with all", different_lists(windows, search), "of 200", 0);
  {
    const VectorSearch turned(windows.searched);
    const double time = time_queries(3, [&](int q) { turned.nearest(query_of(windows, q), neighbours, scratch); });
    add("k = 10, a query, axes turned again", time * 1e3, "ms");
    add("lists that differ, axes turned again", different_lists(windows, turned), "of 200", 0);
  }
  return report;
}

}  // namespace kinespace
