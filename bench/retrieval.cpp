// `kinespace bench retrieval`: do queries make sense - leave-one-out nearest-neighbour accuracy on labelled clips,
// beside two plain methods on the same data in the same run.
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <numeric>
#include <vector>

#include <fmt/format.h>

#include "bench/report.h"
#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/fpca/clip_space.h"
#include "kinespace/fpca/pose_features.h"
#include "kinespace/kernels/calibration.h"
#include "kinespace/kernels/dtw.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

struct Labelled {
  std::vector<PreparedClip> clips;
  std::vector<std::string> content;  // the name's first part
  std::vector<std::string> style;    // content and second part
  std::vector<int> take;
};

Labelled load_labelled(const std::filesystem::path& folder) {
  const auto files = find_motion_files({folder});
  Labelled out;
  out.clips.resize(files.size());
  parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) { out.clips[i] = prepare(read_clip(files[i])); });
  for (const auto& file : files) {
    const std::string name = file.stem().string();
    const std::size_t first = name.find('_');
    const std::size_t last = name.rfind('_');
    out.content.push_back(name.substr(0, first));
    out.style.push_back(name.substr(0, last));
    int take = 0;
    std::from_chars(name.data() + std::min(last + 1, name.size()), name.data() + name.size(), take);
    out.take.push_back(take);
  }
  return out;
}

// Whether b may be the answer to a: not a itself, and "far": not a take of its own class recorded right beside it.
bool may_answer(const Labelled& data, std::size_t a, std::size_t b, bool far) {
  if (a == b) return false;
  return !far || data.style[a] != data.style[b] || std::abs(data.take[a] - data.take[b]) > 5;
}

struct Accuracy {
  double content = 0;
  double style = 0;
};

// Share of clips whose nearest other clip, by `nearest`, has the same content, and the same content and style; in
// percent.
Accuracy accuracy(const Labelled& data, const std::function<std::size_t(std::size_t)>& nearest) {
  std::vector<std::size_t> answer(data.clips.size());
  parallel_for(std::size_t{0}, answer.size(), [&](std::size_t i) { answer[i] = nearest(i); });
  Accuracy out;
  for (std::size_t i = 0; i < answer.size(); ++i) {
    if (answer[i] >= answer.size()) continue;
    out.content += data.content[i] == data.content[answer[i]] ? 1 : 0;
    out.style += data.style[i] == data.style[answer[i]] ? 1 : 0;
  }
  const double scale = 100.0 / static_cast<double>(answer.size());
  return {out.content * scale, out.style * scale};
}

using Vectors = std::vector<std::vector<float>>;

std::size_t nearest_vector(const Labelled& data, const Vectors& vectors, std::size_t i, bool far) {
  std::size_t best = vectors.size();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < vectors.size(); ++j) {
    if (!may_answer(data, i, j, far)) continue;
    const double d = squared_distance(vectors[i], vectors[j], {});
    if (d < least) {
      least = d;
      best = j;
    }
  }
  return best;
}

// The plain method: quaternions and root velocity of the whole clip at 64 times, weighted as the space of clips is.
Vectors resampled_vectors(const Labelled& data, const ClipSpace& space) {
  constexpr int points = 64;
  Vectors out(data.clips.size());
  parallel_for(std::size_t{0}, out.size(), [&](std::size_t i) {
    SampleMatrix values = data.clips[i].curves.values;
    space.space().apply_references(values);
    const int last = static_cast<int>(values.rows()) - 1;
    const double rate = data.clips[i].curves.rate_hz;
    SampleMatrix s = RunSampler(values, Run{{0, last}}, rate).sample(0, last, Warp(), points);
    s.leftCols<3>() *= space.travel_scale() * last / rate;
    const ScoreMatrix flat = s.cast<float>();
    out[i].assign(flat.data(), flat.data() + flat.size());
  });
  return out;
}

FeatureSet keyframes_of(const Labelled& data) {
  std::vector<PoseFeatures> features(data.clips.size());
  parallel_for(std::size_t{0}, features.size(),
               [&](std::size_t i) { features[i] = pose_features(data.clips[i].curves, data.clips[i].skeleton); });
  FeatureSet out{.dims = features.front().dims};
  for (const PoseFeatures& f : features) out.add(f.values);
  return out;
}

// The plain second method: DTW of every pair. [query][target], normalised costs.
std::vector<float> all_costs(const FeatureSet& features, const Compute& compute) {
  const int n = features.clips();
  std::vector<float> out(static_cast<std::size_t>(n) * static_cast<std::size_t>(n),
                         std::numeric_limits<float>::infinity());
  const auto pairs = all_pairs(n);
  constexpr std::size_t block = 100000;
  for (std::size_t start = 0; start < pairs.size(); start += block) {
    const auto part = std::span(pairs).subspan(start, std::min(block, pairs.size() - start));
    const auto matches = dtw(features, features, part, {.band_fraction = 0.1}, compute);
    for (std::size_t i = 0; i < part.size(); ++i) {
      const auto a = static_cast<std::size_t>(part[i].query);
      const auto b = static_cast<std::size_t>(part[i].target);
      out[a * static_cast<std::size_t>(n) + b] = static_cast<float>(matches[i].normalised);
      out[b * static_cast<std::size_t>(n) + a] = static_cast<float>(matches[i].normalised);
    }
  }
  return out;
}

// The nearest by DTW, of all others or of the `candidates` nearest vectors.
std::size_t nearest_by_cost(const Labelled& data, const std::vector<float>& costs, const Vectors* vectors,
                            std::size_t candidates, std::size_t i, bool far) {
  const std::size_t n = data.clips.size();
  std::vector<std::size_t> order;
  for (std::size_t j = 0; j < n; ++j) {
    if (may_answer(data, i, j, far)) order.push_back(j);
  }
  if (vectors != nullptr && order.size() > candidates) {
    std::vector<double> distance(n, 0.0);
    for (const std::size_t j : order) distance[j] = squared_distance((*vectors)[i], (*vectors)[j], {});
    std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(candidates), {},
                              [&](std::size_t j) { return distance[j]; });
    order.resize(candidates);
  }
  std::size_t best = n;
  float least = std::numeric_limits<float>::infinity();
  for (const std::size_t j : order) {
    if (costs[i * n + j] < least) {
      least = costs[i * n + j];
      best = j;
    }
  }
  return best;
}

class RetrievalRows {
 public:
  explicit RetrievalRows(BenchReport& report) : report_(report) {}
  void add(const std::string& method, bool far, const Accuracy& a, const Accuracy* floor) {
    const std::string how = far ? ", far" : "";
    add_one(method + ", by content" + how, a.content,
            floor != nullptr ? std::optional(floor->content - 1.5) : std::nullopt);
    add_one(method + ", by content and style" + how, a.style,
            floor != nullptr ? std::optional(floor->style - 1.5) : std::nullopt);
  }

 private:
  void add_one(const std::string& name, double value, std::optional<double> bar) {
    report_.results.push_back(
        {.name = name, .data = "bandai2", .value = value, .unit = "%", .bar = bar, .higher_is_better = true});
  }
  BenchReport& report_;
};

}  // namespace

BenchReport bench_retrieval(const BenchOptions& options) {
  const Compute compute = open_calibrated(options.device);
  const Labelled data = load_labelled(options.data / "bandai2");
  OrientationMoments orientations(curve_layout(data.clips.front().skeleton).joint_count());
  for (const PreparedClip& clip : data.clips) orientations.add(clip.curves.values);
  const ClipSpace space = ClipSpace::build(source_of(data.clips), orientations.references(), {}, compute);
  Vectors vectors(data.clips.size());
  parallel_for(std::size_t{0}, vectors.size(),
               [&](std::size_t i) { vectors[i] = space.vector_of(data.clips[i].curves, compute); });
  const Vectors plain = resampled_vectors(data, space);
  const std::vector<float> costs = all_costs(keyframes_of(data), compute);

  BenchReport report{.bench = "retrieval", .device = compute.describe(), .threads = 2, .results = {}};
  RetrievalRows rows(report);
  for (const bool far : {false, true}) {
    const Accuracy l2 = accuracy(data, [&](std::size_t i) { return nearest_vector(data, plain, i, far); });
    const Accuracy dtw_all =
        accuracy(data, [&](std::size_t i) { return nearest_by_cost(data, costs, nullptr, 0, i, far); });
    const Accuracy ours = accuracy(data, [&](std::size_t i) { return nearest_vector(data, vectors, i, far); });
    const Accuracy reranked =
        accuracy(data, [&](std::size_t i) { return nearest_by_cost(data, costs, &vectors, 50, i, far); });
    // Bars: within 1.5 points of the plain method of the same run.
    rows.add("resampled curves, L2", far, l2, nullptr);
    rows.add("DTW with all", far, dtw_all, nullptr);
    rows.add("motion vectors", far, ours, &l2);
    rows.add("motion vectors, best 50 by DTW", far, reranked, &dtw_all);
  }
  report.kernels = compute.uses();
  return report;
}

}  // namespace kinespace
