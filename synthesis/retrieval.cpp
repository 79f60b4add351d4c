#include "kinespace/synthesis/retrieval.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/pose_features.h"
#include "kinespace/kernels/dtw.h"
#include "kinespace/kernels/keyframe_distance.h"
#include "kinespace/synthesis/detail/library_clips.h"

namespace kinespace {
namespace {

struct Candidate {
  std::int64_t clip_id = 0;
  double squared = 0;  // distance of the vectors
  double cost = 0;     // of the DTW
};

// The vectors that may be among the `keep` nearest to the query: all but those that the kernel's distances, with what
// their rounding may be, tell to be farther than so many others. Places in the matrix, ascending.
//
// A sum of d products in float is within d 2^-23 of its terms' magnitudes, so the kernel's squared distance is within
// d 2^-23 (|a|^2 + |b|^2), norms about the vectors' mean; |b| <= |a| + the distance itself.
std::vector<std::size_t> perhaps_nearest(const RetrievalMatrix& matrix, const std::vector<float>& query,
                                         const std::vector<float>& weights, std::vector<std::size_t> places,
                                         std::size_t keep, const Compute& compute) {
  const auto dims = static_cast<Eigen::Index>(matrix.dimensions);
  const double flops = 2.0 * static_cast<double>(places.size()) * static_cast<double>(dims);
  if (places.size() <= keep || compute.device_for(KernelFamily::keyframe_distances, flops) == nullptr) return places;
  RowMatrix<float> vectors(static_cast<Eigen::Index>(places.size()), dims);
  for (std::size_t i = 0; i < places.size(); ++i) {
    vectors.row(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::RowVectorXf>(matrix.values.data() + places[i] * matrix.dimensions, dims);
  }
  RowMatrix<float> wanted = Eigen::Map<const Eigen::RowVectorXf>(query.data(), dims);
  if (!weights.empty()) {
    Eigen::RowVectorXf scale(dims);
    for (Eigen::Index d = 0; d < dims; ++d) scale(d) = weights[static_cast<std::size_t>(d) % weights.size()];
    vectors.array().rowwise() *= scale.array();
    wanted.array().rowwise() *= scale.array();
  }
  const RowMatrix<float> table = keyframe_distances(wanted, vectors, DistanceKind::squared, compute);
  const double own = (wanted - vectors.colwise().mean()).cast<double>().norm();
  std::vector<double> slack(places.size());
  std::vector<double> farthest(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto found = static_cast<double>(table(0, static_cast<Eigen::Index>(i)));
    const double other = own + std::sqrt(found);
    slack[i] = 0x1p-22 * static_cast<double>(dims) * (own * own + other * other);
    farthest[i] = found + slack[i];
  }
  std::vector<double> sorted = farthest;
  std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(keep - 1));
  const double limit = sorted[keep - 1];
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (farthest[i] - 2 * slack[i] <= limit) out.push_back(places[i]);
  }
  return out;
}

// The `keep` nearest vectors, nearest first, of clips that may be matches.
std::vector<Candidate> nearest_vectors(const RetrievalMatrix& matrix, const std::vector<float>& query,
                                       const std::vector<float>& weights, const std::vector<ClipRow>& rows,
                                       const QueryOptions& options, const std::string& except, std::size_t keep,
                                       const Compute& compute) {
  std::vector<std::size_t> allowed;
  std::size_t row = 0;
  for (std::size_t i = 0; i < matrix.clip_ids.size(); ++i) {
    while (row < rows.size() && rows[row].id < matrix.clip_ids[i]) ++row;
    if (row == rows.size() || rows[row].id != matrix.clip_ids[i]) continue;
    if ((!except.empty() && rows[row].name == except) || !has_labels(rows[row], options.labels)) continue;
    allowed.push_back(i);
  }
  std::vector<Candidate> out;
  for (const std::size_t i : perhaps_nearest(matrix, query, weights, std::move(allowed), keep, compute)) {
    const auto vector = std::span(matrix.values).subspan(i * matrix.dimensions, matrix.dimensions);
    out.push_back({.clip_id = matrix.clip_ids[i], .squared = squared_distance(query, vector, weights)});
  }
  const auto nearer = [](const Candidate& a, const Candidate& b) {
    return a.squared != b.squared ? a.squared < b.squared : a.clip_id < b.clip_id;
  };
  keep = std::min(keep, out.size());
  std::ranges::partial_sort(out, out.begin() + static_cast<std::ptrdiff_t>(keep), nearer);
  out.resize(keep);
  return out;
}

// Candidates whose features are in memory together, and what the DTW makes of them.
class RerankBatch {
 public:
  RerankBatch(ClipCurves curves, const Skeleton& skeleton, const QueryOptions& options, const Compute& compute)
      : options_(options), compute_(compute) {
    PoseFeatures features = pose_features(curves, skeleton);
    query_ = {curves.frames(), features.rows};
    queries_.dims = targets_.dims = features.dims;
    queries_.starts.push_back(features.rows);
    queries_.values = std::move(features.values);  // of a long clip as large as its curves
  }

  // True when the batch is large enough to be worked off.
  bool add(Candidate& candidate, int frames, const PoseFeatures& features) {
    targets_.add(features.values);
    bands_.push_back(rerank_band(options_.band, query_, {frames, features.rows}));
    waiting_.push_back(&candidate);
    return targets_.values.size() >= most_numbers;
  }

  // Pairs of one band go together.
  void work_off() {
    std::vector<bool> done(waiting_.size(), false);
    for (std::size_t first = 0; first < waiting_.size(); ++first) {
      if (done[first]) continue;
      std::vector<ClipPair> pairs;
      for (std::size_t i = first; i < waiting_.size(); ++i) {
        if (bands_[i] != bands_[first]) continue;
        pairs.push_back({0, static_cast<int>(i)});
        done[i] = true;
      }
      const auto matches = dtw(queries_, targets_, pairs, {.band_fraction = bands_[first]}, compute_);
      for (std::size_t p = 0; p < pairs.size(); ++p) {
        waiting_[static_cast<std::size_t>(pairs[p].target)]->cost = matches[p].normalised;
      }
    }
    waiting_.clear();
    bands_.clear();
    targets_ = {.dims = queries_.dims};
  }

 private:
  static constexpr std::size_t most_numbers = std::size_t{1} << 24;  // 64 MiB

  const QueryOptions& options_;
  const Compute& compute_;
  RerankClip query_;
  FeatureSet queries_;
  FeatureSet targets_;
  std::vector<double> bands_;
  std::vector<Candidate*> waiting_;
};

void rerank(LibraryView& library, ClipCurves curves, const Skeleton& skeleton, const QueryOptions& options,
            const Compute& compute, const Progress& progress, std::vector<Candidate>& candidates) {
  progress.at("warp", 0);
  RerankBatch batch(std::move(curves), skeleton, options, compute);
  for (Candidate& candidate : candidates) {
    progress.check_stop();
    const ClipRow row = library.library().clip(candidate.clip_id);
    // What the first functions leave out is far below what tells two motions apart.
    constexpr int functions = 12;
    const ClipCurves target = library.curves(row, functions);
    if (batch.add(candidate, target.frames(), pose_features(target, library.skeleton(row.skeleton_id)))) {
      batch.work_off();
    }
  }
  progress.check_stop();
  batch.work_off();
  std::ranges::stable_sort(candidates, {}, &Candidate::cost);
}

}  // namespace

void QueryOptions::validate() const {
  const auto fail = [](const std::string& found, const char* expected) {
    throw Error(ErrorKind::usage, {.found = found, .expected = expected});
  };
  if (k < 1) fail(fmt::format("k = {}", k), "1 or more");
  if (candidates < 1) fail(fmt::format("candidates = {}", candidates), "1 or more");
  if (!(band > 0 && band <= 1)) fail(fmt::format("band = {}", band), "above 0, up to 1");
}

double rerank_band(double band, const RerankClip& a, const RerankClip& b) {
  constexpr int ordinary_frames = 10'000;
  constexpr double most_cells = 1e7;
  constexpr double least_keyframes = 100;
  if (std::max(a.frames, b.frames) <= ordinary_frames) return band;
  const double all_cells = static_cast<double>(a.keyframes) * static_cast<double>(b.keyframes);
  const double least = least_keyframes / std::max({1, a.keyframes, b.keyframes});
  return std::min(band, std::max(most_cells / (2 * std::max(all_cells, 1.0)), least));
}

std::vector<Match> nearest_motions(LibraryView& library, ClipCurves curves, const Skeleton& skeleton,
                                   const QueryOptions& options, const std::string& except, const Compute& compute,
                                   const Progress& progress) {
  options.validate();
  progress.at("search", 0);
  const auto space_id = library.space_for(skeleton);
  if (!space_id) return {};
  const std::vector<float> query = library.clip_space(*space_id).vector_of(curves, compute);
  const RetrievalMatrix matrix = library.library().retrieval_matrix(*space_id);
  if (matrix.dimensions != 0 && matrix.dimensions != query.size()) {
    throw Error(ErrorKind::bad_input, {.file = library.library().path().string(),
                                       .found = fmt::format("retrieval vectors of {} numbers", matrix.dimensions),
                                       .expected = fmt::format("{}, as the space of clips has", query.size()),
                                       .remedy = "build the library again"});
  }
  const std::vector<float> weights = options.weighted ? distance_weights(skeleton) : std::vector<float>();
  const auto wanted = static_cast<std::size_t>(options.k);
  const std::size_t keep = options.rerank ? std::max(wanted, static_cast<std::size_t>(options.candidates)) : wanted;
  const std::vector<ClipRow> rows = library.library().clips();
  std::vector<Candidate> found = nearest_vectors(matrix, query, weights, rows, options, except, keep, compute);
  if (options.rerank) rerank(library, std::move(curves), skeleton, options, compute, progress, found);
  found.resize(std::min(found.size(), wanted));

  std::vector<Match> out;
  for (const Candidate& candidate : found) {
    const auto row = std::ranges::lower_bound(rows, candidate.clip_id, {}, &ClipRow::id);
    const double distance = std::sqrt(candidate.squared);
    out.push_back({.clip = row->name,
                   .distance = options.rerank ? candidate.cost : distance,
                   .vector_distance = distance,
                   .start_s = 0,
                   .end_s = static_cast<double>(row->frames - 1) / row->rate_hz,
                   .labels = row->labels});
  }
  return out;
}

std::vector<Match> nearest_motions(LibraryView& library, const Clip& clip, const QueryOptions& options,
                                   const std::string& except, const Compute& compute, const Progress& progress) {
  return nearest_motions(library, clip_curves(clip), clip.skeleton, options, except, compute, progress);
}

}  // namespace kinespace
