#include "codecs/qbc/curve_task.h"

#include <cmath>
#include <cstddef>

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

double quarter_step(int index) {
  constexpr std::array<double, 4> table{1, 0.8408964152537145, 0.7071067811865476, 0.5946035575013605};
  const int whole = index >= 0 ? index / 4 : -((-index + 3) / 4);
  return std::ldexp(table[static_cast<std::size_t>(index - 4 * whole)], -whole);
}

const BernsteinGram& bernstein_gram(int length) {
  static const std::vector<BernsteinGram> grams = make_grams();
  return grams[static_cast<std::size_t>(length)];
}

const ReducedGram& reduced_gram(int length) {
  static const std::vector<ReducedGram> grams = make_reduced();
  return grams[static_cast<std::size_t>(length)];
}

SegmentSums segment_sums(const CurveTask& task, int first, int last) {
  SegmentSums out;
  const int m = last - first;
  const auto n = static_cast<std::size_t>(task.dimensions);
  const double* p = task.at(first + 1);
  for (int f = 1; f <= m; ++f, p += n) {
    const double t = static_cast<double>(f) / m;
    const double a = (1 - t) * (1 - t), b = 2 * t * (1 - t), c = t * t;
    for (std::size_t d = 0; d < n; ++d) {
      out.r0[d] += a * p[d], out.r1[d] += b * p[d], out.r2[d] += c * p[d];
      out.square += p[d] * p[d];
    }
  }
  return out;
}

}  // namespace kinespace
