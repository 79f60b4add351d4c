#include "kinespace/codecs/qbc/detail/curve_task.h"

#include <bit>
#include <cstddef>
#include <cstdint>

namespace kinespace {
namespace {

std::vector<BernsteinGram> make_grams() {
  std::vector<BernsteinGram> out(longest_segment + 1);
  for (int m = 1; m <= longest_segment; ++m) {
    BernsteinGram& g = out[static_cast<std::size_t>(m)];
    for (int f = 1; f <= m; ++f) {
      const double t = static_cast<double>(f) / m;
      const double a = (1 - t) * (1 - t), b = 2 * t * (1 - t), c = t * t;
      g.g00 += a * a, g.g01 += a * b, g.g02 += a * c, g.g11 += b * b, g.g12 += b * c, g.g22 += c * c;
    }
  }
  return out;
}

std::vector<ReducedGram> make_reduced() {
  std::vector<ReducedGram> out(longest_segment + 1);
  for (int m = 1; m <= longest_segment; ++m) {
    const BernsteinGram& g = bernstein_gram(m);
    ReducedGram& r = out[static_cast<std::size_t>(m)];
    r = {.g00 = g.g00, .g02 = g.g02, .g22 = g.g22};
    if (m < 2) continue;
    r.g00 -= g.g01 * g.g01 / g.g11, r.g02 -= g.g01 * g.g12 / g.g11, r.g22 -= g.g12 * g.g12 / g.g11;
  }
  return out;
}

}  // namespace

namespace {

// 2^exponent, between the smallest and the largest normal number.
double power_of_two(int exponent) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
}

}  // namespace

double quarter_step(int index) {
  constexpr std::array<double, 4> table{1, 0.8408964152537145, 0.7071067811865476, 0.5946035575013605};
  const int whole = index >= 0 ? index / 4 : -((-index + 3) / 4);
  return table[static_cast<std::size_t>(index - 4 * whole)] * power_of_two(-whole);
}

const BernsteinGram& bernstein_gram(int length) {
  static const std::vector<BernsteinGram> grams = make_grams();
  return grams[static_cast<std::size_t>(length)];
}

const ReducedGram& reduced_gram(int length) {
  static const std::vector<ReducedGram> grams = make_reduced();
  return grams[static_cast<std::size_t>(length)];
}

RunningSums::RunningSums(const CurveTask& task)
    : interval_(task.interval),
      n_(static_cast<std::size_t>(task.dimensions)),
      sums_(static_cast<std::size_t>(task.frames)) {
  Sums sums;
  for (int f = 1; f < task.frames; ++f) {
    if ((f - 1) % interval_ == 0) sums = {};
    const double t = (f - 1) % interval_ + 1;
    const double* p = task.at(f);
    for (std::size_t d = 0; d < n_; ++d) {
      sums.one[d] += p[d], sums.linear[d] += t * p[d], sums.quadratic[d] += t * t * p[d];
      sums.square += p[d] * p[d];
    }
    sums_[static_cast<std::size_t>(f)] = sums;
  }
}

SegmentSums RunningSums::segment(int first, int last) const {
  static constexpr Sums none{};
  const Sums& to = sums_[static_cast<std::size_t>(last)];
  const Sums& from = first % interval_ == 0 ? none : sums_[static_cast<std::size_t>(first)];
  const double start = first % interval_, length = 1.0 / (last - first);
  SegmentSums out{.square = to.square - from.square};
  for (std::size_t d = 0; d < n_; ++d) {
    const double one = to.one[d] - from.one[d], linear = to.linear[d] - from.linear[d];
    const double quadratic = to.quadratic[d] - from.quadratic[d];
    const double first_moment = (linear - start * one) * length;
    out.r2[d] = (quadratic - start * (2 * linear - start * one)) * length * length;
    out.r1[d] = 2 * (first_moment - out.r2[d]);
    out.r0[d] = one - 2 * first_moment + out.r2[d];
  }
  return out;
}

}  // namespace kinespace
