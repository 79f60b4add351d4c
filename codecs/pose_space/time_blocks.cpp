#include "kinespace/codecs/pose_space/time_blocks.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/Cholesky>

#include "kinespace/codecs/stream/natural_functions.h"

namespace kinespace {
namespace {

// Functions of one parity: numbers 0, 2, 4 .. or 1, 3, 5 ..; on the first half of the points.
Eigen::MatrixXd half_functions(const NaturalFunctions& functions, int parity) {
  const int n = functions.points();
  const int half = (n + 1) / 2;
  const int count = (functions.count() + 1 - parity) / 2;
  Eigen::MatrixXd out(half, count);
  for (int i = 0; i < count; ++i) {
    const std::vector<double> f = functions.function(2 * i + parity);
    out.col(i) = Eigen::Map<const Eigen::VectorXd>(f.data(), half);
  }
  return out;
}

// The fit of one parity: coefficients = table' * folded curve, table is [half][count].
Eigen::MatrixXd half_fit(const NaturalFunctions& functions, int parity) {
  const Eigen::MatrixXd f = half_functions(functions, parity);
  if (f.cols() == 0) return f;
  // Mirrored pairs count twice, the middle of an odd number of points once.
  Eigen::VectorXd weight = Eigen::VectorXd::Constant(f.rows(), 2);
  if (functions.points() % 2 == 1) weight(f.rows() - 1) = 1;
  const Eigen::MatrixXd gram = f.transpose() * weight.asDiagonal() * f;
  return gram.llt().solve(f.transpose()).transpose();
}

// The windows' lengths in grid steps that are tried; a window of m steps begins at multiples of about m / 4.
constexpr std::array<int, 12> tried{1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 24, 32};

// One stretch without jumps.
class StretchPlan {
 public:
  StretchPlan(std::span<const double> curves, int curve_count, int frames, double rate_hz,
              const BlockPlanOptions& options)
      : curves_(curves), curve_count_(curve_count), frames_(frames), rate_hz_(rate_hz), options_(options) {}

  void plan(int first, int last, std::vector<int>& lengths) {
    const int grid = std::clamp(static_cast<int>(std::lround(options_.grid_s * rate_hz_)), 1, options_.longest_frames);
    const int total = last - first;
    const int steps = (total + grid - 1) / grid;
    std::vector<double> best(static_cast<std::size_t>(steps) + 1, std::numeric_limits<double>::infinity());
    std::vector<int> from(static_cast<std::size_t>(steps) + 1, 0);
    best[0] = 0;
    for (int start = 0; start < steps; ++start) {
      const double before = best[static_cast<std::size_t>(start)];
      if (!std::isfinite(before)) continue;
      for (const int m : tried) {
        const int end = std::min(start + m, steps);
        const bool aligned = start % std::max(1, m / 4) == 0 || end == steps;
        const int length = std::min(end * grid, total) - start * grid;
        if (length > options_.longest_frames || (!aligned && m > 1)) continue;
        const double price = before + window_bits(first + start * grid, length);
        if (price < best[static_cast<std::size_t>(end)]) {
          best[static_cast<std::size_t>(end)] = price;
          from[static_cast<std::size_t>(end)] = start;
        }
        if (end == steps) break;
      }
    }
    std::vector<int> reversed;
    for (int end = steps; end > 0; end = from[static_cast<std::size_t>(end)]) {
      reversed.push_back(std::min(end * grid, total) - from[static_cast<std::size_t>(end)] * grid);
    }
    lengths.insert(lengths.end(), reversed.rbegin(), reversed.rend());
  }

 private:
  double window_bits(int first, int length) {
    constexpr double highest_hz = 5;
    const double k = std::ceil(2 * highest_hz * length / rate_hz_) + 2;
    const int functions = static_cast<int>(std::min(k, static_cast<double>(length)));
    const WindowTransform& transform = transform_for(length, functions);
    coefficients_.resize(static_cast<std::size_t>(curve_count_) * static_cast<std::size_t>(functions));
    transform.analyse(curves_.data() + first, frames_, curve_count_, coefficients_.data());
    return options_.window_bits + bits_of(coefficients_, 1);
  }
  const WindowTransform& transform_for(int length, int functions) {
    const auto found = transforms_.find(length);
    if (found != transforms_.end()) return found->second;
    return transforms_.emplace(length, WindowTransform(length, functions)).first->second;
  }

  std::span<const double> curves_;
  int curve_count_;
  int frames_;
  double rate_hz_;
  const BlockPlanOptions& options_;
  std::vector<double> coefficients_;
  std::map<int, WindowTransform> transforms_;
};

}  // namespace

std::vector<int> find_jumps(const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>& curves,
                            double unit_cm, std::vector<int> jumps) {
  constexpr double break_cm = 10;
  constexpr double break_ratio = 4;
  const Eigen::Index n = curves.cols();
  std::vector<double> travel(static_cast<std::size_t>(n), 0.0);
  for (Eigen::Index f = 1; f < n; ++f) {
    travel[static_cast<std::size_t>(f)] = (curves.col(f) * unit_cm - curves.col(f - 1) * unit_cm).norm();
  }
  for (std::size_t f = 1; f < travel.size(); ++f) {
    const double before = f > 1 ? travel[f - 1] : 0;
    const double after = f + 1 < travel.size() ? travel[f + 1] : 0;
    if (travel[f] > break_cm && travel[f] > break_ratio * std::max(before, after)) jumps.push_back(static_cast<int>(f));
  }
  std::ranges::sort(jumps);
  jumps.erase(std::unique(jumps.begin(), jumps.end()), jumps.end());
  return jumps;
}

std::vector<int> plan_blocks(std::span<const double> curves, int curve_count, int frames, double rate_hz,
                             std::span<const int> jumps, const BlockPlanOptions& options) {
  std::vector<int> out;
  StretchPlan plan(curves, curve_count, frames, rate_hz, options);
  int first = 0;
  for (const int jump : jumps) {
    plan.plan(first, jump, out);
    first = jump;
  }
  plan.plan(first, frames, out);
  return out;
}

WindowTransform::WindowTransform(int points, int functions) : points_(points), functions_(functions) {
  assert(functions >= 1 && functions <= points);
  const NaturalFunctions natural(points, functions);
  const Eigen::MatrixXd even = half_fit(natural, 0);
  const Eigen::MatrixXd odd = half_fit(natural, 1);
  // [point][even functions, then odd functions]
  table_.reserve(static_cast<std::size_t>(even.size() + odd.size()));
  for (Eigen::Index t = 0; t < even.rows(); ++t) {
    for (Eigen::Index k = 0; k < even.cols(); ++k) table_.push_back(even(t, k));
    for (Eigen::Index k = 0; k < odd.cols(); ++k) table_.push_back(odd(t, k));
  }
}

void WindowTransform::analyse(const double* curves, std::ptrdiff_t stride, int curve_count, double* out) const {
  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Table = Eigen::Map<const RowMatrix, 0, Eigen::OuterStride<>>;
  const Eigen::Index n = points_;
  const Eigen::Index half = (n + 1) / 2;
  const Eigen::Index evens = (functions_ + 1) / 2;
  const Eigen::Index odds = functions_ - evens;
  // Even functions see the sums of mirrored points, odd ones their differences.
  const Eigen::Map<const RowMatrix, 0, Eigen::OuterStride<>> all(curves, curve_count, n, Eigen::OuterStride<>(stride));
  RowMatrix folded = all.leftCols(half) + all.rightCols(half).rowwise().reverse();
  if (n % 2 == 1) folded.col(half - 1) = all.col(half - 1);
  const RowMatrix even = folded * Table(table_.data(), half, evens, Eigen::OuterStride<>(functions_));
  folded = all.leftCols(half) - all.rightCols(half).rowwise().reverse();
  const RowMatrix odd = folded * Table(table_.data() + evens, half, odds, Eigen::OuterStride<>(functions_));
  for (Eigen::Index c = 0; c < curve_count; ++c) {
    double* target = out + c * functions_;
    for (Eigen::Index k = 0; k < evens; ++k) target[2 * k] = even(c, k);
    for (Eigen::Index k = 0; k < odds; ++k) target[2 * k + 1] = odd(c, k);
  }
}

double bits_of(std::span<const double> coefficients, double step) {
  double out = 0;
  for (const double c : coefficients) {
    const double size = std::abs(c) / step;
    if (size > 0.5) out += 1.5 * std::log2(1 + size);
  }
  return out;
}

}  // namespace kinespace
