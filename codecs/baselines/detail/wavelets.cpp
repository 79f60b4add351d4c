#include "kinespace/codecs/baselines/detail/wavelets.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>

namespace kinespace {
namespace {

constexpr double root_of_two = 1.4142135623730950488;

// The index mirrored into [0, n) about the first and the last sample.
std::ptrdiff_t mirrored(std::ptrdiff_t i, std::ptrdiff_t n) {
  if (i < 0) i = -i;
  return i < n ? i : 2 * (n - 1) - i;
}

// Adds `weight` times the sum of both neighbours to every second sample from `first` on.
void lift_pairs(std::span<double> x, std::ptrdiff_t first, double weight) {
  const auto n = static_cast<std::ptrdiff_t>(x.size());
  double* p = x.data();
  for (std::ptrdiff_t i = first; i < n; i += 2) p[i] += weight * (p[mirrored(i - 1, n)] + p[mirrored(i + 1, n)]);
}

// The lifting steps of daubechies, sweldens 1998.
constexpr std::array<double, 4> cdf97_steps{-1.586134342059924, -0.052980118572961, 0.882911075530934,
                                            0.443506852043971};
constexpr double cdf97_scale = 1.149604398860241;

void split_cdf97(std::span<double> x) {
  for (std::size_t s = 0; s < cdf97_steps.size(); ++s) lift_pairs(x, s % 2 == 0 ? 1 : 0, cdf97_steps[s]);
}

void join_cdf97(std::span<double> x) {
  for (std::size_t s = cdf97_steps.size(); s-- > 0;) lift_pairs(x, s % 2 == 0 ? 1 : 0, -cdf97_steps[s]);
}

void predict_cubic(std::span<double> x, double sign) {
  const auto n = static_cast<std::ptrdiff_t>(x.size());
  double* p = x.data();
  for (std::ptrdiff_t i = 1; i < n; i += 2) {
    const double near = p[mirrored(i - 1, n)] + p[mirrored(i + 1, n)];
    const double far = p[mirrored(i - 3, n)] + p[mirrored(i + 3, n)];
    p[i] += sign * (9. / 16 * near - 1. / 16 * far);
  }
}

void update_cubic(std::span<double> x, double sign) {
  const auto n = static_cast<std::ptrdiff_t>(x.size());
  double* p = x.data();
  for (std::ptrdiff_t i = 0; i < n; i += 2) {
    const double near = p[mirrored(i - 1, n)] + p[mirrored(i + 1, n)];
    const double far = p[mirrored(i - 3, n)] + p[mirrored(i + 3, n)];
    p[i] += sign * (9. / 32 * near - 1. / 32 * far);
  }
}

void split(Wavelet wavelet, std::span<double> x) {
  if (wavelet == Wavelet::cdf97) return split_cdf97(x);
  predict_cubic(x, -1);
  update_cubic(x, 1);
}

void join(Wavelet wavelet, std::span<double> x) {
  if (wavelet == Wavelet::cdf97) return join_cdf97(x);
  update_cubic(x, -1);
  predict_cubic(x, 1);
}

struct Scales {
  double coarse = 1;
  double detail = 1;
  double coarsest = 1;  // besides, for the coarse curve that is left at the end
};

// The lengths of the cubic basis curves of level 1, 2, .. are 0.5722, 0.4833, 0.4728, .. times sqrt(2)^level; those of
// the coarse curve 0.8950 times that.
Scales scales_of(Wavelet wavelet, std::size_t level) {
  if (wavelet == Wavelet::cdf97) return {.coarse = cdf97_scale, .detail = 1 / cdf97_scale};
  constexpr std::array<double, 3> details{0.5722, 0.4833, 0.4728};
  return {.coarse = root_of_two, .detail = root_of_two * details[std::min<std::size_t>(level, 2)], .coarsest = 0.895};
}

}  // namespace

WaveletTransform::WaveletTransform(Wavelet wavelet, int length) : wavelet_(wavelet), length_(length) {
  for (int n = length; n >= shortest && levels() < most_levels; n = (n + 1) / 2) lengths_.push_back(n);
}

std::vector<int> WaveletTransform::edges() const {
  std::vector<int> out{length_};
  for (const int n : lengths_) out.insert(out.begin(), (n + 1) / 2);
  out.insert(out.begin(), 0);
  return out;
}

void WaveletTransform::forward(std::span<const double> curve, std::span<double> coefficients) const {
  assert(static_cast<int>(curve.size()) == length_ && static_cast<int>(coefficients.size()) == length_);
  std::ranges::copy(curve, coefficients.begin());
  std::vector<double> x(coefficients.size());
  double coarsest = 1;
  for (std::size_t level = 0; level < lengths_.size(); ++level) {
    const auto n = static_cast<std::size_t>(lengths_[level]);
    const std::span<double> work = std::span(x).first(n);
    std::ranges::copy(coefficients.first(n), work.begin());
    split(wavelet_, work);
    const Scales scale = scales_of(wavelet_, level);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t place = i % 2 == 0 ? i / 2 : (n + 1) / 2 + i / 2;
      coefficients[place] = work[i] * (i % 2 == 0 ? scale.coarse : scale.detail);
    }
    coarsest = scale.coarsest;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(edges()[1]); ++i) coefficients[i] *= coarsest;
}

void WaveletTransform::inverse(std::span<const double> coefficients, std::span<double> curve) const {
  assert(static_cast<int>(curve.size()) == length_ && static_cast<int>(coefficients.size()) == length_);
  std::ranges::copy(coefficients, curve.begin());
  std::vector<double> x(curve.size());
  const double coarsest = lengths_.empty() ? 1 : scales_of(wavelet_, lengths_.size() - 1).coarsest;
  for (std::size_t i = 0; i < static_cast<std::size_t>(edges()[1]); ++i) curve[i] /= coarsest;
  for (std::size_t level = lengths_.size(); level-- > 0;) {
    const auto n = static_cast<std::size_t>(lengths_[level]);
    const std::span<double> work = std::span(x).first(n);
    const Scales scale = scales_of(wavelet_, level);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t place = i % 2 == 0 ? i / 2 : (n + 1) / 2 + i / 2;
      work[i] = curve[place] / (i % 2 == 0 ? scale.coarse : scale.detail);
    }
    join(wavelet_, work);
    std::ranges::copy(work, curve.begin());
  }
}

}  // namespace kinespace
