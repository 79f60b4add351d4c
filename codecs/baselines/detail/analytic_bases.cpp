#include "kinespace/codecs/baselines/detail/analytic_bases.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include <Eigen/Core>

#include "kinespace/codecs/stream/natural_functions.h"

namespace kinespace {

void DiscreteFourier::Numbers::resize(std::size_t n) {
  re.assign(n, 0);
  im.assign(n, 0);
}

DiscreteFourier::DiscreteFourier(int points) : points_(points) {
  const auto n = static_cast<std::size_t>(points);
  padded_ = std::bit_ceil(2 * n);
  roots_.resize(padded_ / 2);
  for (std::size_t t = 0; t < padded_ / 2; ++t) {
    fixed_sin_cos(-2 * std::numbers::pi * static_cast<double>(t) / static_cast<double>(padded_), roots_.im[t],
                  roots_.re[t]);
  }
  chirp_.resize(n);
  chirp_filter_.resize(padded_);
  for (std::uint64_t t = 0; t < n; ++t) {
    const auto turns = static_cast<double>(t * t % (2 * n)) / static_cast<double>(n);
    fixed_sin_cos(-std::numbers::pi * turns, chirp_.im[t], chirp_.re[t]);
    for (const std::size_t place : {static_cast<std::size_t>(t), t == 0 ? 0 : padded_ - t}) {
      chirp_filter_.re[place] = chirp_.re[t];
      chirp_filter_.im[place] = -chirp_.im[t];
    }
  }
  power_of_two(chirp_filter_);
}

void DiscreteFourier::power_of_two(Numbers& x) const {
  const std::size_t n = padded_;
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n / 2;
    for (; (j & bit) != 0; bit /= 2) j ^= bit;
    j ^= bit;
    if (i < j) {
      std::swap(x.re[i], x.re[j]);
      std::swap(x.im[i], x.im[j]);
    }
  }
  for (std::size_t size = 1; size < n; size *= 2) {
    const std::size_t stride = n / (2 * size);
    for (std::size_t from = 0; from < n; from += 2 * size) {
      for (std::size_t k = 0; k < size; ++k) {
        const double c = roots_.re[k * stride], s = roots_.im[k * stride];
        const std::size_t a = from + k, b = a + size;
        const double re = x.re[b] * c - x.im[b] * s;
        const double im = x.re[b] * s + x.im[b] * c;
        x.re[b] = x.re[a] - re;
        x.im[b] = x.im[a] - im;
        x.re[a] += re;
        x.im[a] += im;
      }
    }
  }
}

void DiscreteFourier::transform(Numbers& x) const {
  const auto n = static_cast<std::size_t>(points_);
  Numbers work;
  work.resize(padded_);
  for (std::size_t t = 0; t < n; ++t) {
    work.re[t] = x.re[t] * chirp_.re[t] - x.im[t] * chirp_.im[t];
    work.im[t] = x.re[t] * chirp_.im[t] + x.im[t] * chirp_.re[t];
  }
  power_of_two(work);
  // The product, conjugated, so that the same transform leads back.
  for (std::size_t t = 0; t < padded_; ++t) {
    const double re = work.re[t] * chirp_filter_.re[t] - work.im[t] * chirp_filter_.im[t];
    const double im = work.re[t] * chirp_filter_.im[t] + work.im[t] * chirp_filter_.re[t];
    work.re[t] = re;
    work.im[t] = -im;
  }
  power_of_two(work);
  const double scale = 1 / static_cast<double>(padded_);
  for (std::size_t t = 0; t < n; ++t) {
    const double re = scale * work.re[t], im = -scale * work.im[t];
    x.re[t] = re * chirp_.re[t] - im * chirp_.im[t];
    x.im[t] = re * chirp_.im[t] + im * chirp_.re[t];
  }
}

void DiscreteFourier::analyse(std::span<const double> curve, std::span<double> coefficients) const {
  const auto n = static_cast<std::size_t>(points_);
  Numbers x;
  x.resize(n);
  std::ranges::copy(curve, x.re.begin());
  transform(x);
  const double one = std::sqrt(1.0 / points_), two = std::sqrt(2.0 / points_);
  coefficients[0] = one * x.re[0];
  for (std::size_t k = 1; k < n; ++k) {
    const std::size_t m = (k + 1) / 2;
    coefficients[k] = 2 * m == n ? one * x.re[m] : k % 2 == 1 ? two * x.re[m] : -two * x.im[m];
  }
}

void DiscreteFourier::synthesise(std::span<const double> coefficients, std::span<double> curve) const {
  const auto n = static_cast<std::size_t>(points_);
  const auto at = [&](std::size_t k) { return k < coefficients.size() ? coefficients[k] : 0.0; };
  const double one = std::sqrt(1.0 / points_), two = std::sqrt(2.0 / points_);
  // The real part of the transform of c(m) + i s(m), over m up to n / 2.
  Numbers x;
  x.resize(n);
  x.re[0] = one * at(0);
  for (std::size_t m = 1; 2 * m <= n; ++m) {
    if (m >= n) break;
    x.re[m] = (2 * m == n ? one : two) * at(2 * m - 1);
    x.im[m] = 2 * m == n ? 0 : two * at(2 * m);
  }
  transform(x);
  std::ranges::copy(x.re, curve.begin());
}

DiscreteLegendre::DiscreteLegendre(int points) : points_(points), half_((points + 1) / 2) {
  const double n = points;
  for (int i = 0; i + 1 < half_; ++i) {
    const double t = i;
    const double a = (t + 1) * (t + 1 - n);
    const double b = t * (t - n);
    here_.push_back((a + b) / a);
    degree_.push_back(1 / a);
    before_.push_back(b / a);
  }
}

void DiscreteLegendre::function(int k, std::span<double> out) const {
  constexpr double huge = 1e140;
  const double kk = static_cast<double>(k) * (k + 1.0);
  double last = 0, now = 1;
  out[0] = 1;
  for (std::size_t t = 0; t + 1 < static_cast<std::size_t>(half_); ++t) {
    const double next = (here_[t] + kk * degree_[t]) * now - before_[t] * last;
    last = now;
    now = next;
    if (std::abs(now) > huge) {  // what stands at the end of the grid is as good as nothing beside this
      now /= huge;
      last /= huge;
      for (std::size_t i = 0; i <= t; ++i) out[i] /= huge;
    }
    out[t + 1] = now;
  }
  const bool middle = points_ % 2 == 1;
  if (middle && k % 2 == 1) out[static_cast<std::size_t>(half_) - 1] = 0;
  double squares = 0;
  for (std::size_t t = 0; t < static_cast<std::size_t>(half_); ++t) {
    const double twice = middle && t + 1 == static_cast<std::size_t>(half_) ? 1 : 2;
    squares += twice * out[t] * out[t];
  }
  const double scale = 1 / std::sqrt(squares);
  for (double& p : out) p *= scale;
}

std::vector<double> DiscreteLegendre::fold(std::span<const double> values, int curves) const {
  const auto n = static_cast<std::size_t>(points_), h = static_cast<std::size_t>(half_);
  std::vector<double> out(static_cast<std::size_t>(curves) * 2 * h);
  for (std::size_t c = 0; c < static_cast<std::size_t>(curves); ++c) {
    for (std::size_t t = 0; t < h; ++t) {
      const double a = values[c * n + t], b = values[c * n + n - 1 - t];
      const bool middle = 2 * t + 1 == n;
      out[2 * c * h + t] = middle ? a : a + b;
      out[(2 * c + 1) * h + t] = a - b;
    }
  }
  return out;
}

void DiscreteLegendre::analyse(std::span<const double> folded, int curves, int first, int last,
                               std::span<double> coefficients, int stride) const {
  std::vector<double> p(static_cast<std::size_t>(half_));
  const Eigen::Map<const Eigen::VectorXd> polynomial(p.data(), half_);
  for (int k = first; k < last; ++k) {
    function(k, p);
    for (int c = 0; c < curves; ++c) {
      const Eigen::Map<const Eigen::VectorXd> curve(folded.data() + static_cast<std::ptrdiff_t>(2 * c + k % 2) * half_,
                                                    half_);
      coefficients[static_cast<std::size_t>(c) * static_cast<std::size_t>(stride) + static_cast<std::size_t>(k)] =
          polynomial.dot(curve);
    }
  }
}

void DiscreteLegendre::synthesise(std::span<const double> coefficients, int curves, int stride, int used,
                                  std::span<double> values) const {
  const auto n = static_cast<std::size_t>(points_), h = static_cast<std::size_t>(half_);
  std::vector<double> p(h);
  std::vector<double> sums(static_cast<std::size_t>(curves) * 2 * h, 0.0);
  for (int k = 0; k < used; ++k) {
    bool any = false;
    for (std::size_t c = 0; c < static_cast<std::size_t>(curves) && !any; ++c) {
      any = coefficients[c * static_cast<std::size_t>(stride) + static_cast<std::size_t>(k)] != 0;
    }
    if (!any) continue;
    function(k, p);
    for (std::size_t c = 0; c < static_cast<std::size_t>(curves); ++c) {
      const double weight = coefficients[c * static_cast<std::size_t>(stride) + static_cast<std::size_t>(k)];
      if (weight == 0) continue;
      double* sum = sums.data() + (2 * c + static_cast<std::size_t>(k % 2)) * h;
      for (std::size_t t = 0; t < h; ++t) sum[t] += weight * p[t];
    }
  }
  for (std::size_t c = 0; c < static_cast<std::size_t>(curves); ++c) {
    for (std::size_t t = 0; t < h; ++t) {
      const double even = sums[2 * c * h + t], odd = sums[(2 * c + 1) * h + t];
      values[c * n + t] = even + odd;
      values[c * n + n - 1 - t] = even - odd;
    }
  }
}

}  // namespace kinespace
