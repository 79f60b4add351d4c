#include "kinespace/codecs/stream/natural_functions.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "kinespace/kernels/simd.h"
#include "kinespace/motion/sine_cosine.h"

namespace kinespace {
namespace {

constexpr double pi = 3.14159265358979323846;

// Roots of cos b cosh b = 1; from the sixth on (k - 1/2) pi to 1e-7.
double root_of_mode(int k) {
  constexpr std::array<double, 5> first{4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464,
                                        17.27875965739948};
  const auto at = static_cast<std::size_t>(k - 2);
  return at < first.size() ? first[at] : (k - 0.5) * pi;
}

// exp(-x), x >= 0: halved until small, the series, squared back.
double fixed_exp_minus(double x) {
  if (x > 700) return 0;
  int halvings = 0;
  for (; x > 0.125; x /= 2) ++halvings;
  double term = 1;
  double sum = 1;
  for (int i = 1; i <= 10; ++i) {
    term *= -x / i;
    sum += term;
  }
  for (; halvings > 0; --halvings) sum *= sum;
  return sum;
}

// One mode at u_t = (t + 1/2) / n - 1/2 for t < half. Angles and exponentials advance by products, started from exact
// values at both ends of the half, so that no rounding adds up.
void tabulate(int k, int n, std::span<double> out) {
  const double b = root_of_mode(k);
  const bool even = k % 2 == 0;
  double sine = 0, cosine = 0;
  fixed_sin_cos(b / 2, sine, cosine);
  const double scale = 1 / ((even ? cosine : sine) * std::sqrt(static_cast<double>(n)));
  const double far = fixed_exp_minus(b);
  const double hyperbolic = 1 / ((even ? 1 + far : 1 - far) * std::sqrt(static_cast<double>(n)));

  double step_sine = 0, step_cosine = 0;
  fixed_sin_cos(b / n, step_sine, step_cosine);
  fixed_sin_cos(b * (0.5 / n - 0.5), sine, cosine);
  const double fall = fixed_exp_minus(b / n);
  double near_edge = fixed_exp_minus(b * 0.5 / n);  // e^{-b (1/2 + u)}: falls from the left end
  for (std::size_t t = 0; t < out.size(); ++t) {
    const double other = far / near_edge;  // e^{-b (1/2 - u)}
    const double from_far = near_edge > 1e-150 ? other : 0;
    out[t] = even ? scale * cosine + hyperbolic * (near_edge + from_far)
                  : scale * sine + hyperbolic * (from_far - near_edge);
    near_edge *= fall;
    const double next_cosine = cosine * step_cosine - sine * step_sine;
    sine = sine * step_cosine + cosine * step_sine;
    cosine = next_cosine;
  }
}

// Adds to the sums of `Rows` curves, [row][half], every second function from `table` on: four at a time, then single
// ones. A function's samples are fetched once for all rows; every sum is made in the same order whatever the vectors'
// width.
template <int Rows>
KINESPACE_SIMD_BODY void add_functions(const double* __restrict table, std::ptrdiff_t half, const double* coefficients,
                                       std::ptrdiff_t stride, int count, double* __restrict sums) {
  int k = 0;
  for (; k + 8 <= count + 1; k += 8) {
    const double* __restrict a0 = table + k * half;
    const double* __restrict a1 = a0 + 2 * half;
    const double* __restrict a2 = a1 + 2 * half;
    const double* __restrict a3 = a2 + 2 * half;
    for (int r = 0; r < Rows; ++r) {
      const double* c = coefficients + r * stride + k;
      const double c0 = c[0], c1 = c[2], c2 = c[4], c3 = c[6];
      double* __restrict sum = sums + r * half;
      for (std::ptrdiff_t t = 0; t < half; ++t) sum[t] += (c0 * a0[t] + c1 * a1[t]) + (c2 * a2[t] + c3 * a3[t]);
    }
  }
  for (; k < count; k += 2) {
    const double* __restrict a = table + k * half;
    for (int r = 0; r < Rows; ++r) {
      const double c = coefficients[r * stride + k];
      double* __restrict sum = sums + r * half;
      for (std::ptrdiff_t t = 0; t < half; ++t) sum[t] += c * a[t];
    }
  }
}

KINESPACE_SIMD_BODY void add_to_one_body(const double* table, std::ptrdiff_t half, const double* coefficients,
                                         std::ptrdiff_t stride, int count, double* sums) {
  add_functions<1>(table, half, coefficients, stride, count, sums);
}
KINESPACE_SIMD_BODY void add_to_four_body(const double* table, std::ptrdiff_t half, const double* coefficients,
                                          std::ptrdiff_t stride, int count, double* sums) {
  add_functions<4>(table, half, coefficients, stride, count, sums);
}
KINESPACE_SIMD(add_to_one, void,
               (const double* table, std::ptrdiff_t half, const double* coefficients, std::ptrdiff_t stride, int count,
                double* sums),
               (table, half, coefficients, stride, count, sums))
KINESPACE_SIMD(add_to_four, void,
               (const double* table, std::ptrdiff_t half, const double* coefficients, std::ptrdiff_t stride, int count,
                double* sums),
               (table, half, coefficients, stride, count, sums))

}  // namespace

void fixed_sin_cos(double x, double& sine, double& cosine) noexcept {
  const double turns = x * (2 / pi);
  const double nearest = turns >= 0 ? static_cast<double>(static_cast<long long>(turns + 0.5))
                                    : -static_cast<double>(static_cast<long long>(0.5 - turns));
  // pi / 2 in two parts, so that whole turns take nothing off the small digits.
  const double r = (x - nearest * 1.57079632673412561417e+00) - nearest * 6.07710050650619224932e-11;
  double s = 0, c = 0;
  sine_and_cosine_near_zero(r, s, c);
  switch (static_cast<long long>(nearest) & 3) {
    case 0:
      sine = s, cosine = c;
      return;
    case 1:
      sine = c, cosine = -s;
      return;
    case 2:
      sine = -s, cosine = -c;
      return;
    default:
      sine = -c, cosine = s;
      return;
  }
}

NaturalFunctions::NaturalFunctions(int points, int count)
    : points_(points),
      count_(count),
      half_((points + 1) / 2),
      table_(static_cast<std::size_t>(count) * static_cast<std::size_t>((points + 1) / 2)) {
  assert(count >= 1 && count <= points);
  const auto half = static_cast<std::size_t>(half_);
  for (int k = 0; k < count; ++k) {
    const std::span<double> row(table_.data() + static_cast<std::size_t>(k) * half, half);
    const double size = std::sqrt(static_cast<double>(points));
    for (std::size_t t = 0; t < half && k < 2; ++t) {
      const double u = (static_cast<double>(t) + 0.5) / points - 0.5;
      row[t] = (k == 0 ? 1 : u * std::sqrt(12.0)) / size;
    }
    if (k >= 2) tabulate(k, points, row);
  }
}

std::vector<double> NaturalFunctions::function(int k) const {
  std::vector<double> coefficients(static_cast<std::size_t>(k) + 1, 0.0);
  coefficients.back() = 1;
  std::vector<double> out(static_cast<std::size_t>(points_));
  synthesise(coefficients, out);
  return out;
}

void NaturalFunctions::synthesise(std::span<const double> coefficients, std::span<double> out) const {
  std::vector<double> scratch;
  synthesise(coefficients.data(), static_cast<std::ptrdiff_t>(coefficients.size()),
             static_cast<int>(coefficients.size()), 1, out.data(), scratch);
}

void NaturalFunctions::synthesise(const double* coefficients, std::ptrdiff_t stride, int used, int curves, double* out,
                                  std::vector<double>& scratch) const {
  assert(used <= count_);
  constexpr int at_once = 4;
  const auto half = static_cast<std::size_t>(half_);
  const auto n = static_cast<std::size_t>(points_);
  const std::ptrdiff_t h = half_;
  scratch.resize(2 * at_once * half);
  for (int first = 0; first < curves;) {
    const int rows = curves - first >= at_once ? at_once : 1;
    std::ranges::fill(scratch, 0.0);
    double* even = scratch.data();
    double* odd = even + at_once * half;
    const double* c = coefficients + first * stride;
    const auto add = rows == at_once ? add_to_four : add_to_one;
    if (used > 0) add(table_.data(), h, c, stride, used, even);
    if (used > 1) add(table_.data() + half, h, c + 1, stride, used - 1, odd);
    for (int r = 0; r < rows; ++r, even += half, odd += half) {
      double* curve = out + static_cast<std::size_t>(first + r) * n;
      for (std::size_t t = 0; t < half; ++t) curve[t] = even[t] + odd[t];
      for (std::size_t t = n - n / 2; t < n; ++t) curve[t] = even[n - 1 - t] - odd[n - 1 - t];
    }
    first += rows;
  }
}

}  // namespace kinespace
