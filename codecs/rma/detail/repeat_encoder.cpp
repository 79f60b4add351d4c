#include "kinespace/codecs/rma/detail/repeat_encoder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <tbb/parallel_for.h>

#include "kinespace/codecs/pose_space/time_blocks.h"
#include "kinespace/codecs/rma/contact_ik.h"
#include "kinespace/codecs/rma/detail/spline_fit.h"
#include "kinespace/codecs/rma/marker_clips.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

constexpr std::size_t metric_samples = 256;
constexpr int planned_components = 16;

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Curves = Eigen::Map<const RowMatrix>;

Curves curves_of(const PoseVectors& vectors, int dimensions) {
  return {vectors.values.data(), dimensions, vectors.frames};
}

double bits_of(std::span<const double> coefficients, double step) {
  double out = 0;
  for (const double c : coefficients) {
    const double size = std::abs(c) / step;
    if (size > 0.5) out += 1.5 * std::log2(1 + size);
  }
  return out;
}

// Functions above this frequency are not looked at: nothing is left of them at such a step.
int functions_for(int points, double rate_hz, double step) {
  const double highest_hz = step > 4 ? 12 : step > 1 ? 25 : 1e9;
  return static_cast<int>(std::min<double>(points, std::ceil(2 * highest_hz * points / rate_hz) + 2));
}

}  // namespace

RepeatEncoder::RepeatEncoder(std::span<const Clip> clips, const Preparation& preparation, const Progress& progress)
    : clips_(clips),
      progress_(progress),
      preparation_(preparation),
      aligned_(align_clips(clips)),
      table_(marker_clip_table(clips, aligned_)) {
  add_statistics();
  std::int64_t start = 0;
  for (const Clip& clip : clips_) {
    starts_.push_back(start);
    start += clip.frames;
  }
  if (preparation_.repeats) analysis_ = analyse_repeats(marker_table(aligned_), {}, progress_);
  progress_.check_stop();
  contacts_.resize(clips_.size());
  if (!preparation_.contacts) return;
  tbb::parallel_for(std::size_t{0}, clips_.size(),
                    [&](std::size_t c) { contacts_[c] = find_contacts(clips_[c], slow_contacts); });
}

// Moments of the pose vectors and the metric, and with them the exact basis.
void RepeatEncoder::add_statistics() {
  const int d = aligned_.reference.dimensions();
  std::vector<Eigen::MatrixXd> moments(clips_.size());
  std::vector<std::int64_t> first{0};
  for (const PoseVectors& v : aligned_.vectors) first.push_back(first.back() + v.frames);
  const std::int64_t frames = first.back();
  tbb::parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) {
    moments[c] = Eigen::MatrixXd::Zero(d, d);
    moments[c].selfadjointView<Eigen::Lower>().rankUpdate(curves_of(aligned_.vectors[c], d));
  });
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(d, d);
  for (const Eigen::MatrixXd& one : moments) total += one;
  total = Eigen::MatrixXd(total.selfadjointView<Eigen::Lower>()) / static_cast<double>(frames);

  const std::int64_t samples = std::min<std::int64_t>(frames, metric_samples);
  std::vector<PoseMetric> metrics(static_cast<std::size_t>(samples));
  tbb::parallel_for(std::int64_t{0}, samples, [&](std::int64_t s) {
    const std::int64_t frame = (2 * s + 1) * frames / (2 * samples);
    const auto c = static_cast<std::size_t>(std::ranges::upper_bound(first, frame) - first.begin()) - 1;
    const Eigen::VectorXd pose = curves_of(aligned_.vectors[c], d).col(frame - first[c]);
    metrics[static_cast<std::size_t>(s)] =
        pose_metric(clips_[c].skeleton, aligned_.reference, std::span(pose.data(), static_cast<std::size_t>(d)));
  });
  PoseMetric mean{Eigen::MatrixXd::Zero(d, d), Eigen::MatrixXd::Zero(d, d)};
  for (const PoseMetric& one : metrics) {
    mean.positions += one.positions / static_cast<double>(samples);
    mean.shell += one.shell / static_cast<double>(samples);
  }
  metric_ = mean.combined(preparation_.shell_weight);
  exact_ = karhunen_loeve(metric_, total);
}

void RepeatEncoder::cut(std::size_t clip, double step) {
  const int d = aligned_.reference.dimensions();
  const int planned = std::min(planned_components, d);
  RowMatrix z = (exact_.basis.transpose() * metric_).topRows(planned) * curves_of(aligned_.vectors[clip], d);
  ClipEntry& entry = table_.clips[clip];
  const std::vector<int> jumps = find_jumps(z, 1, aligned_.vectors[clip].jumps);
  z /= step;
  entry.blocks = plan_blocks({z.data(), static_cast<std::size_t>(z.size())}, planned, entry.frames, entry.rate_hz,
                             jumps, {.longest_frames = longest_block});
  entry.finer.assign(entry.blocks.size(), 0);
}

void RepeatEncoder::plan(double step) {
  tbb::parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) { cut(c, step); });
  windows_.clear();
  first_of_clip_.assign(1, 0);
  jumps_.clear();
  for (std::size_t c = 0; c < clips_.size(); ++c) {
    const int d = aligned_.reference.dimensions();
    const Curves x = curves_of(aligned_.vectors[c], d);
    const RowMatrix analysis = (exact_.basis.transpose() * metric_).topRows(std::min(planned_components, d));
    const std::vector<int> jumps = find_jumps(analysis * x, 1, aligned_.vectors[c].jumps);
    int first = 0;
    for (const int points : table_.clips[c].blocks) {
      windows_.push_back({.clip = static_cast<int>(c), .first = first, .points = points});
      jumps_.push_back(std::ranges::binary_search(jumps, first));
      first += points;
    }
    first_of_clip_.push_back(windows_.size());
  }
  std::map<std::pair<int, int>, std::size_t> sizes;
  std::vector<std::shared_ptr<const WindowTransform>> made;
  std::vector<std::size_t> which;
  std::vector<std::pair<int, int>> wanted;
  for (const WindowPlace& w : windows_) {
    const double rate = table_.clips[static_cast<std::size_t>(w.clip)].rate_hz;
    const std::pair size{w.points, functions_for(w.points, rate, step)};
    const auto [at, is_new] = sizes.emplace(size, wanted.size());
    if (is_new) wanted.push_back(size);
    which.push_back(at->second);
  }
  made.resize(wanted.size());
  tbb::parallel_for(std::size_t{0}, wanted.size(), [&](std::size_t i) {
    made[i] = std::make_shared<const WindowTransform>(wanted[i].first, wanted[i].second);
  });
  transforms_.clear();
  for (const std::size_t i : which) transforms_.push_back(made[i]);
  progress_.check_stop();
  find_predictions(step);
}

// The reference frames of a window: those of the repeated clips in it, gone on from where there are none.
WindowPrediction RepeatEncoder::candidate(std::size_t w) const {
  constexpr double least_share = 0.2;
  const WindowPlace& window = windows_[w];
  const auto clip = static_cast<std::size_t>(window.clip);
  const std::int64_t first = starts_[clip] + window.first;
  const std::int64_t last = first + window.points;
  // The repeated clip that covers most of it.
  const auto& all = analysis_.clips;
  auto at = std::ranges::upper_bound(all, first, {}, &RepeatClip::first);
  if (at != all.begin()) --at;
  const RepeatClip* best = nullptr;
  std::int64_t most = 0;
  for (; at != all.end() && at->first < last; ++at) {
    const std::int64_t shared = std::min(last, at->last) - std::max(first, at->first);
    if (at->kind != RepeatClip::Kind::repeated || shared <= most) continue;
    most = shared;
    best = &*at;
  }
  WindowPrediction out;
  if (best == nullptr || static_cast<double>(most) < least_share * window.points) return out;
  const RepeatClip& primary = all[static_cast<std::size_t>(best->primary)];
  const auto target = static_cast<std::size_t>(std::ranges::upper_bound(starts_, primary.first) - starts_.begin()) - 1;
  const std::int64_t low = starts_[target];
  const std::int64_t high = low + clips_[target].frames - 1;
  const double rate = table_.clips[clip].rate_hz;
  for (const int k : regular_knots(window.points, prediction_span(rate))) {
    const std::int64_t frame = first + k;
    const std::int64_t inside = std::clamp(frame, best->first, best->last - 1);
    const std::int64_t reference = best->reference[static_cast<std::size_t>(inside - best->first)] + frame - inside;
    out.frames.push_back(static_cast<std::int32_t>(std::clamp(reference, low, high) - low));
  }
  out.clip = static_cast<int>(target);
  // How the two face, in the middle.
  const auto heading = [&](std::size_t c, std::int64_t frame) {
    return aligned_.vectors[c].curve(3)[static_cast<std::size_t>(frame)];
  };
  const double turn =
      (heading(clip, window.first + window.points / 2) - heading(target, out.frames[out.frames.size() / 2])) /
      (2 * std::numbers::pi);
  out.turn = static_cast<std::int32_t>(std::lround((turn - std::round(turn)) * WindowPrediction::turn_steps));
  return out;
}

std::vector<double> RepeatEncoder::predicted_from_originals(std::size_t w, const WindowPrediction& prediction) const {
  const PoseVectors& vectors = aligned_.vectors[static_cast<std::size_t>(prediction.clip)];
  const int points = windows_[w].points;
  std::vector<double> out(static_cast<std::size_t>(aligned_.reference.dimensions()) * static_cast<std::size_t>(points));
  const double rate = table_.clips[static_cast<std::size_t>(windows_[w].clip)].rate_hz;
  predict_window(prediction, points, prediction_span(rate), vectors.values, 0, vectors.frames, out);
  return out;
}

std::vector<double> RepeatEncoder::analyse(std::size_t w, std::span<const double> vectors,
                                           const Eigen::MatrixXd& projection) const {
  const WindowPlace& window = windows_[w];
  const RowMatrix z = projection * Curves(vectors.data(), projection.cols(), window.points);
  const WindowTransform& transform = *transforms_[w];
  std::vector<double> out(static_cast<std::size_t>(z.rows()) * static_cast<std::size_t>(transform.functions()));
  transform.analyse(z.data(), z.cols(), static_cast<int>(z.rows()), out.data());
  return out;
}

// [dimension][points] of a window's own frames.
std::vector<double> RepeatEncoder::own_vectors(std::size_t w) const {
  const WindowPlace& window = windows_[w];
  const PoseVectors& vectors = aligned_.vectors[static_cast<std::size_t>(window.clip)];
  const int dimensions = aligned_.reference.dimensions();
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>(dimensions) * static_cast<std::size_t>(window.points));
  for (int k = 0; k < dimensions; ++k) {
    const auto curve =
        vectors.curve(k).subspan(static_cast<std::size_t>(window.first), static_cast<std::size_t>(window.points));
    out.insert(out.end(), curve.begin(), curve.end());
  }
  return out;
}

void RepeatEncoder::find_predictions(double step) {
  predictions_.assign(windows_.size(), {});
  if (analysis_.clips.empty()) return;
  constexpr double overhead_bits = 24;
  const int d = aligned_.reference.dimensions();
  const Eigen::MatrixXd projection = (exact_.basis.transpose() * metric_).topRows(std::min(planned_components, d));
  std::vector<WindowPrediction> candidates(windows_.size());
  std::vector<double> gain(windows_.size(), 0.0);
  tbb::parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
    candidates[w] = candidate(w);
    if (!candidates[w].used()) return;
    std::vector<double> own = own_vectors(w);
    const double alone = bits_of(analyse(w, own, projection), step);
    const std::vector<double> told = predicted_from_originals(w, candidates[w]);
    for (std::size_t i = 0; i < own.size(); ++i) own[i] -= told[i];
    const double moves = 3.0 * static_cast<double>(candidates[w].frames.size());
    gain[w] = alone - bits_of(analyse(w, own, projection), step) - overhead_bits - moves;
  });
  std::vector<std::size_t> order;
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    if (gain[w] > 0) order.push_back(w);
  }
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return gain[a] > gain[b]; });
  std::vector<bool> referred(windows_.size(), false);
  for (const std::size_t w : order) {
    const WindowPrediction& p = candidates[w];
    const auto clip = static_cast<std::size_t>(p.clip);
    const int first = p.first_frame();
    const int last = p.last_frame() + 1;
    std::vector<std::size_t> rests_on;
    bool possible = !referred[w];
    // Windows of a clip follow one another in time.
    const auto of_clip =
        std::span(windows_).subspan(first_of_clip_[clip], first_of_clip_[clip + 1] - first_of_clip_[clip]);
    const auto nearest = std::ranges::partition_point(
        of_clip, [&](const WindowPlace& place) { return place.first + place.points <= first; });
    for (auto r = first_of_clip_[clip] + static_cast<std::size_t>(nearest - of_clip.begin());
         r < first_of_clip_[clip + 1] && windows_[r].first <= last; ++r) {
      possible = possible && r != w && !predictions_[r].used();
      rests_on.push_back(r);
    }
    if (!possible) continue;
    predictions_[w] = p;
    for (const std::size_t r : rests_on) referred[r] = true;
  }
}

}  // namespace kinespace
