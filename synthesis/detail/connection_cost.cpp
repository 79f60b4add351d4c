#include "kinespace/synthesis/detail/connection_cost.h"

#include <algorithm>

#include "kinespace/motion/simd.h"
#include "kinespace/synthesis/curve_sampler.h"

namespace kinespace::connections {
namespace {

constexpr auto most_form_rows = static_cast<std::size_t>(2 * most_functions);
// Numbers at the points of an overlap, [row][point].
using PointRows = std::array<double, most_form_rows * overlap_points>;

// out = form in, for rows x rows numbers of a column-major form: along the points, so that it vectorises.
KINESPACE_VECTOR_CLONES
void apply_form(const double* form, const double* in, double* out, Eigen::Index rows) {
  for (Eigen::Index r = 0; r < rows; ++r) {
    double sum[overlap_points] = {};
    for (Eigen::Index c = 0; c < rows; ++c) {
      const double factor = form[c * rows + r];
      for (int p = 0; p < overlap_points; ++p) sum[p] += factor * in[c * overlap_points + p];
    }
    for (int p = 0; p < overlap_points; ++p) out[r * overlap_points + p] = sum[p];
  }
}

// sum over the rows of a * b, point by point.
KINESPACE_VECTOR_CLONES
void add_products(const double* a, const double* b, Eigen::Index rows, double* sums) {
  double sum[overlap_points] = {};
  for (Eigen::Index r = 0; r < rows; ++r) {
    for (int p = 0; p < overlap_points; ++p) sum[p] += a[r * overlap_points + p] * b[r * overlap_points + p];
  }
  for (int p = 0; p < overlap_points; ++p) sums[p] = sum[p];
}

// An end of the overlap and how it moves.
struct OverlapEnd {
  double at = 0, by_u = 0, by_v = 0;
};

}  // namespace

FunctionCurves::FunctionCurves(const SampleMatrix& functions) : knots_(functions.rows(), 2 * functions.cols()) {
  const UniformSpline spline(functions);
  knots_.leftCols(functions.cols()) = functions;
  for (Eigen::Index i = 0; i < functions.rows(); ++i) {
    spline.derivative(static_cast<double>(i), knots_.row(i).tail(functions.cols()));
  }
}

void FunctionCurves::at(double x, double* values, double* slopes, Eigen::Index step) const {
  const auto cells = static_cast<double>(knots_.rows() - 1);
  const double place = std::clamp(x, 0.0, 1.0) * cells;
  const auto i = std::min(static_cast<Eigen::Index>(place), knots_.rows() - 2);
  const double b = place - static_cast<double>(i), a = 1 - b;
  const Eigen::Index n = count();
  const double* left = knots_.row(i).data();
  const double* right = knots_.row(i + 1).data();
  const double of_left = a * a * (1 + 2 * b), of_right = b * b * (3 - 2 * b);
  const double by_left = a * a * b, by_right = -b * b * a, rise = 6 * a * b * cells;
  const double bend_left = a * (1 - 3 * b) * cells, bend_right = b * (3 * b - 2) * cells;
  for (Eigen::Index k = 0; k < n; ++k) {
    values[k * step] = of_left * left[k] + of_right * right[k] + by_left * left[n + k] + by_right * right[n + k];
    slopes[k * step] = rise * (right[k] - left[k]) + bend_left * left[n + k] + bend_right * right[n + k];
  }
}

PairCost::PairCost(const FunctionCurves& functions, const ConnectionMotion& first, const ConnectionMotion& second)
    : functions_(functions), first_(first), second_(second) {
  const Eigen::Index rest = first.scores.cols() - InvariantPose::rates;
  const auto rates_of = [](const ConnectionMotion& motion) -> Eigen::MatrixXd {
    return motion.scores.leftCols(InvariantPose::rates).cast<double>();
  };
  const Eigen::MatrixXd rest_of_first = first.scores.rightCols(rest).cast<double>();
  const Eigen::MatrixXd rest_of_second = second.scores.rightCols(rest).cast<double>();
  cross_rates_ = rates_of(first) * rates_of(second).transpose();
  cross_rest_ = rest_of_first * rest_of_second.transpose();
}

// With b1 = b(t), b2 = b(s) and M = [S11, -S12; -S12', S22], E is the mean of b' M b over the points of the overlap, its
// slope 2 (M b)' b_theta + b' M_theta b; the points are s = begin + w (end - begin), t = u s + v.
double PairCost::operator()(double u, double v, OverlapEnds ends, Eigen::Vector2d& slopes) const {
  const Eigen::Index count = functions_.count(), rows = 2 * count;
  const OverlapEnd begin = ends.begin_moves ? OverlapEnd{-v / u, v / (u * u), -1 / u} : OverlapEnd{0, 0, 0};
  const OverlapEnd end = ends.end_moves ? OverlapEnd{(1 - v) / u, (v - 1) / (u * u), -1 / u} : OverlapEnd{1, 0, 0};
  PointRows b, b_slopes, m_b;
  std::array<double, overlap_points> s_by_u{}, s_by_v{}, t_by_u{}, t_by_v{};
  for (int p = 0; p < overlap_points; ++p) {
    const auto i = static_cast<std::size_t>(p);
    const double w = (p + 0.5) / overlap_points;
    const double s = begin.at + w * (end.at - begin.at);
    s_by_u[i] = (1 - w) * begin.by_u + w * end.by_u;
    s_by_v[i] = (1 - w) * begin.by_v + w * end.by_v;
    t_by_u[i] = s + u * s_by_u[i];
    t_by_v[i] = 1 + u * s_by_v[i];
    functions_.at(u * s + v, b.data() + p, b_slopes.data() + p, overlap_points);
    const Eigen::Index of_second = count * overlap_points + p;
    functions_.at(s, b.data() + of_second, b_slopes.data() + of_second, overlap_points);
  }

  const double speed = speed_of(first_, second_, u);
  Eigen::MatrixXd m(rows, rows);
  m.topLeftCorner(count, count) = speed * speed * first_.rates + first_.rest;
  m.topRightCorner(count, count) = -speed * cross_rates_ - cross_rest_;
  m.bottomLeftCorner(count, count) = m.topRightCorner(count, count).transpose();
  m.bottomRightCorner(count, count) = second_.rates + second_.rest;
  apply_form(m.data(), b.data(), m_b.data(), rows);

  std::array<double, overlap_points> sums{}, of_t{}, of_s{};
  add_products(b.data(), m_b.data(), rows, sums.data());
  add_products(b_slopes.data(), m_b.data(), count, of_t.data());
  const std::ptrdiff_t half = count * overlap_points;
  add_products(b_slopes.data() + half, m_b.data() + half, count, of_s.data());
  double sum = 0;
  slopes.setZero();
  for (std::size_t p = 0; p < overlap_points; ++p) {
    sum += sums[p];
    slopes[0] += 2 * (of_t[p] * t_by_u[p] + of_s[p] * s_by_u[p]);
    slopes[1] += 2 * (of_t[p] * t_by_v[p] + of_s[p] * s_by_v[p]);
  }
  // By the speed of play alone: d(speed) / du = speed / u.
  using Points = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, overlap_points, Eigen::RowMajor>>;
  const Points b1(b.data(), count, overlap_points), b2(b.data() + half, count, overlap_points);
  const Eigen::MatrixXd rates1 = first_.scores.leftCols(InvariantPose::rates).cast<double>().transpose() * b1;
  const Eigen::MatrixXd rates2 = second_.scores.leftCols(InvariantPose::rates).cast<double>().transpose() * b2;
  slopes[0] += 2 * speed / u * (speed * rates1.squaredNorm() - rates1.cwiseProduct(rates2).sum());
  slopes /= overlap_points;
  return sum / overlap_points;
}

double PairCost::operator()(double u, double v) const {
  Eigen::Vector2d unused;
  return std::max(0.0, (*this)(u, v, ends_of(u, v), unused));
}

}  // namespace kinespace::connections
