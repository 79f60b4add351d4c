#include "kinespace/repeats/segmentation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "kinespace/base/parallel.h"
#include "kinespace/repeats/detail/frame_moments.h"
#include "kinespace/repeats/detail/option_range.h"

namespace kinespace {
namespace {

// Frames of one clip, forward or backward in time, in steps: prefix sums of x and of x x', so that the moments of any
// stretch of whole steps cost a subtraction.
class StepSums {
 public:
  StepSums(const FrameTable& table, FrameSpan clip, std::int64_t step, bool backward)
      : steps_(clip.frames() / step), sum_(steps_ + 1), products_(steps_ + 1), step_(step) {
    const int d = table.dimensions;
    sum_[0] = Eigen::VectorXd::Zero(d);
    products_[0] = Eigen::MatrixXd::Zero(d, d);
    for (std::size_t s = 0; s < steps_; ++s) {
      const auto offset = static_cast<std::int64_t>(s) * step;
      const std::int64_t first = backward ? clip.last - offset - step : clip.first + offset;
      const Eigen::MatrixXd x = frame_matrix(table, {first, first + step}).cast<double>();
      sum_[s + 1] = sum_[s] + x.rowwise().sum();
      products_[s + 1] = products_[s] + x * x.transpose();
    }
  }

  [[nodiscard]] std::size_t steps() const { return steps_; }
  [[nodiscard]] Eigen::VectorXd mean(std::size_t first, std::size_t last) const {
    return (sum_[last] - sum_[first]) / frames(first, last);
  }
  // The mean of (x - origin)(x - origin)'.
  [[nodiscard]] Eigen::MatrixXd moment(std::size_t first, std::size_t last, const Eigen::VectorXd& origin) const {
    const Eigen::VectorXd m = mean(first, last);
    return (products_[last] - products_[first]) / frames(first, last) - m * origin.transpose() -
           origin * m.transpose() + origin * origin.transpose();
  }

 private:
  [[nodiscard]] double frames(std::size_t first, std::size_t last) const {
    return static_cast<double>(static_cast<std::int64_t>(last - first) * step_);
  }

  std::size_t steps_;
  std::vector<Eigen::VectorXd> sum_;
  std::vector<Eigen::MatrixXd> products_;
  std::int64_t step_;
};

// Barbic's H for the model of steps [first, middle) and the motion in [middle, last), 1 where the model is right.
double unlikeness(const StepSums& sums, std::size_t first, std::size_t middle, std::size_t last, double variance,
                  double least_variance) {
  const Eigen::VectorXd mean = sums.mean(first, middle);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> model(sums.moment(first, middle, mean));
  const Eigen::MatrixXd seen = sums.moment(middle, last, mean);
  const auto d = model.eigenvalues().size();
  const double total = model.eigenvalues().cwiseMax(0).sum();
  double kept = 0, explained = 0, h = 0;
  Eigen::Index q = 0;
  while (q < d && kept < variance * total) {
    const auto axis = model.eigenvectors().col(d - 1 - q);
    const double lambda = model.eigenvalues()(d - 1 - q);
    const double along = axis.dot(seen * axis);
    h += along / std::max(lambda, least_variance);
    explained += along;
    kept += lambda;
    ++q;
  }
  if (q < d) {
    const double noise = std::max((total - kept) / static_cast<double>(d - q), least_variance);
    h += std::max(seen.trace() - explained, 0.0) / noise;
  }
  return h / static_cast<double>(d);
}

struct Pace {
  std::int64_t step = 1;   // frames
  std::size_t window = 1;  // steps
};

// The cuts of one direction, in steps from its beginning.
std::vector<std::size_t> direction_cuts(const StepSums& sums, std::size_t window, double least_variance,
                                        const SegmentationOptions& options) {
  std::vector<std::size_t> cuts;
  std::size_t first = 0;
  double valley = std::numeric_limits<double>::infinity(), previous = 0;
  for (std::size_t middle = window; middle + window <= sums.steps(); ++middle) {
    const double h = unlikeness(sums, first, middle, middle + window, options.variance, least_variance);
    if (previous > valley + options.rise && h < previous) {
      first = middle - 1;
      cuts.push_back(first);
      middle = first + window - 1;
      valley = std::numeric_limits<double>::infinity();
      previous = 0;
      continue;
    }
    valley = std::min(valley, h);
    previous = h;
  }
  return cuts;
}

void add_clip_cuts(const FrameTable& table, FrameSpan clip, const Pace& pace, double least_variance,
                   const SegmentationOptions& options, std::vector<std::int64_t>& cuts) {
  const auto step = pace.step;
  if (clip.frames() < 2 * static_cast<std::int64_t>(pace.window) * step) return;
  for (const bool backward : {false, true}) {
    const StepSums sums(table, clip, step, backward);
    for (const std::size_t cut : direction_cuts(sums, pace.window, least_variance, options)) {
      const std::int64_t frames = static_cast<std::int64_t>(cut) * step;
      cuts.push_back(backward ? clip.last - frames : clip.first + frames);
    }
  }
}

// The segments between the cuts of a clip: cuts nearer than `apart` are one, at their mean, and none is that near to an
// end of the clip.
std::vector<FrameSpan> segments_between(FrameSpan clip, std::vector<std::int64_t> cuts, std::int64_t apart) {
  apart = std::max<std::int64_t>(apart, 1);
  std::sort(cuts.begin(), cuts.end());
  std::vector<FrameSpan> out;
  std::int64_t first = clip.first;
  for (std::size_t c = 0; c < cuts.size();) {
    std::int64_t sum = 0, count = 0;
    for (const std::int64_t begin = cuts[c]; c < cuts.size() && cuts[c] - begin < apart; ++c, ++count) sum += cuts[c];
    const std::int64_t cut = sum / count;
    if (cut - first < apart || clip.last - cut < apart) continue;
    out.push_back({first, cut});
    first = cut;
  }
  out.push_back({first, clip.last});
  return out;
}

}  // namespace

void SegmentationOptions::validate() const {
  require_option("window_s", window_s, 0.05, 60);
  require_option("step_s", step_s, 0.01, 10);
  require_option("variance", variance, 0.5, 0.9999);
  require_option("rise", rise, 1e-6, 1e9);
  require_option("apart_s", apart_s, 0, 60);
  require_option("dimensions", dimensions, 2, 64);
}

std::vector<FrameSpan> behaviour_segments(const FrameTable& table, const SegmentationOptions& options) {
  options.validate();
  table.validate();
  const FrameTable reduced = reduced_table(table, options.dimensions);
  const FrameSpan all{0, reduced.frames};
  const double total = frame_moments(reduced, std::span(&all, 1)).covariance.trace();
  const double least_variance = std::max(1e-4 * total / reduced.dimensions, 1e-12);
  Pace pace;
  pace.step = std::max<std::int64_t>(1, std::llround(options.step_s * table.rate_hz));
  pace.window = static_cast<std::size_t>(
      std::max<std::int64_t>(1, std::llround(options.window_s * table.rate_hz / static_cast<double>(pace.step))));
  const auto apart = static_cast<std::int64_t>(std::llround(options.apart_s * table.rate_hz));

  std::vector<std::vector<FrameSpan>> parts(table.starts.size());
  parallel_for(std::size_t{0}, parts.size(), [&](std::size_t c) {
    const FrameSpan clip{table.starts[c], c + 1 < table.starts.size() ? table.starts[c + 1] : table.frames};
    std::vector<std::int64_t> cuts;
    add_clip_cuts(reduced, clip, pace, least_variance, options, cuts);
    parts[c] = segments_between(clip, std::move(cuts), apart);
  });
  std::vector<FrameSpan> out;
  for (const auto& part : parts) out.insert(out.end(), part.begin(), part.end());
  return out;
}

}  // namespace kinespace
