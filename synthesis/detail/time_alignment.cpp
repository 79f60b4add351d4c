#include "kinespace/synthesis/detail/time_alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "kinespace/fpca/pose_features.h"
#include "kinespace/kernels/dtw.h"

namespace kinespace {
namespace {

constexpr double knot_s = 0.2;
constexpr double least_slope = 0.1;  // of the mean slope: what stands still in one motion still passes in the other

// The mean of the matched keyframes of `other` for each keyframe of `reference`.
std::vector<double> matched_keyframes(std::span<const FramePair> path, int keyframes) {
  std::vector<double> sum(static_cast<std::size_t>(keyframes)), count(sum.size());
  for (const FramePair& pair : path) {
    sum[static_cast<std::size_t>(pair.query)] += pair.target;
    count[static_cast<std::size_t>(pair.query)] += 1;
  }
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] /= count[i];
  return sum;
}

}  // namespace

TimeMap::TimeMap(std::vector<double> from, std::vector<double> to)
    : from_(std::move(from)), to_(std::move(to)), slope_(from_.size()) {
  const std::size_t last = from_.size() - 1;
  const auto secant = [&](std::size_t i) { return (to_[i + 1] - to_[i]) / (from_[i + 1] - from_[i]); };
  slope_.front() = secant(0);
  slope_.back() = secant(last - 1);
  // The harmonic mean of the neighbours keeps the cubic monotone.
  for (std::size_t i = 1; i < last; ++i) slope_[i] = 2 / (1 / secant(i - 1) + 1 / secant(i));
}

double TimeMap::operator()(double time_s) const {
  const auto after = std::ranges::upper_bound(from_, time_s) - from_.begin();
  const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - 1, 0, std::ssize(from_) - 2));
  const double width = from_[i + 1] - from_[i];
  const double x = std::clamp((time_s - from_[i]) / width, 0.0, 1.0);
  const double y = 1 - x;
  return y * y * (1 + 2 * x) * to_[i] + x * x * (1 + 2 * y) * to_[i + 1] +
         width * x * y * (y * slope_[i] - x * slope_[i + 1]);
}

TimeMap align_times(const ClipCurves& reference, const ClipCurves& other, const Skeleton& skeleton) {
  const double from_s = (reference.frames() - 1) / reference.rate_hz;
  const double to_s = (other.frames() - 1) / other.rate_hz;
  const PoseFeatures a = pose_features(reference, skeleton), b = pose_features(other, skeleton);
  const int keyframes = std::min(a.rows, b.rows);
  const int knots = static_cast<int>(from_s / knot_s);
  if (keyframes < 3 || knots < 2) return {from_s, to_s};

  FeatureSet first{.dims = a.dims}, second{.dims = b.dims};
  first.add(a.values);
  second.add(b.values);
  const std::array<ClipPair, 1> pair{ClipPair{0, 0}};
  DtwOptions options{.steps = StepPattern::slope_limited, .want_path = true};
  auto match = dtw(first, second, pair, options);
  if (!match[0].found()) {
    options.steps = StepPattern::symmetric;
    match = dtw(first, second, pair, options);
  }
  const std::vector<double> matched = matched_keyframes(match[0].path, a.rows);

  std::vector<double> from{0}, to{0};
  const double step = from_s / knots;
  const double least = least_slope * to_s / knots;
  for (int k = 1; k < knots; ++k) {
    // Over half a knot to either side, so that the stairs are smoothed away.
    const double centre = k * step / from_s * (a.rows - 1), half = step / from_s * (a.rows - 1) / 2;
    double sum = 0, count = 0;
    for (int i = static_cast<int>(std::ceil(centre - half)); i <= centre + half; ++i) {
      sum += matched[static_cast<std::size_t>(std::clamp(i, 0, a.rows - 1))];
      count += 1;
    }
    const double time = count > 0 ? sum / count / (b.rows - 1) * to_s : to_s * k / knots;
    from.push_back(k * step);
    to.push_back(std::clamp(time, to.back() + least, to_s - (knots - k) * least));
  }
  from.push_back(from_s);
  to.push_back(to_s);
  return {std::move(from), std::move(to)};
}

}  // namespace kinespace
