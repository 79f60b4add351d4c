#include "kinespace/kernels/local_linear.h"

#include <cmath>
#include <vector>

#include <Eigen/QR>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/fpca/sample_curves.h"

namespace kinespace {
namespace {

constexpr SmoothingKernel all_kernels[] = {SmoothingKernel::epanechnikov, SmoothingKernel::quartic,
                                           SmoothingKernel::gauss};

double place(int i, int n) {
  return static_cast<double>(i) / (n - 1);
}

// The first coefficient of the weighted least-squares fit, as the definition has it.
double fit(const std::vector<Eigen::Vector3d>& rows, const std::vector<double>& weights,
           const std::vector<double>& values) {
  Eigen::MatrixXd design(rows.size(), 3);
  Eigen::VectorXd right(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    design.row(row) = std::sqrt(weights[i]) * rows[i].transpose();
    right[row] = std::sqrt(weights[i]) * values[i];
  }
  return design.colPivHouseholderQr().solve(right)[0];
}

Eigen::MatrixXd random_symmetric(int n) {
  const CurveMatrix y = test::random_curves(n, n, 21);
  return y + y.transpose();
}

TEST(LocalLinear, kernels_integrate_to_one) {
  for (const SmoothingKernel kernel : all_kernels) {
    double sum = 0;
    for (int i = -8000; i <= 8000; ++i) sum += kernel_value(kernel, i / 1000.0) / 1000;
    EXPECT_NEAR(sum, 1, 1e-6);
    EXPECT_EQ(kernel_value(kernel, 0.7), kernel_value(kernel, -0.7));
  }
  EXPECT_EQ(kernel_value(SmoothingKernel::epanechnikov, 1.5), 0);
  EXPECT_EQ(kernel_value(SmoothingKernel::quartic, -1.5), 0);
}

TEST(LocalLinear, a_line_stays_a_line_up_to_its_ends) {
  std::vector<double> values(30);
  for (int i = 0; i < 30; ++i) values[static_cast<std::size_t>(i)] = 3 - 2 * place(i, 30);
  const std::vector<double> at = {0, 0.013, 0.5, 1};
  for (const SmoothingKernel kernel : all_kernels) {
    const auto out = local_linear_line(values, {}, kernel, 0.1, at);
    for (std::size_t i = 0; i < at.size(); ++i) EXPECT_NEAR(out[i], 3 - 2 * at[i], 1e-12);
  }
}

TEST(LocalLinear, a_weight_counts_like_repeated_points) {
  const std::vector<double> values = {1, 5, 2, 8, 3, 9, 4};
  const std::vector<double> weights = {1, 2, 1, 3, 0, 1, 2};
  for (const SmoothingKernel kernel : all_kernels) {
    const std::vector<double> at = {0.3, 0.9};
    const auto out = local_linear_line(values, weights, kernel, 0.4, at);
    for (std::size_t p = 0; p < at.size(); ++p) {
      double s0 = 0, s1 = 0, s2 = 0, r0 = 0, r1 = 0;
      for (int i = 0; i < 7; ++i) {
        for (int repeat = 0; repeat < static_cast<int>(weights[static_cast<std::size_t>(i)]); ++repeat) {
          const double d = place(i, 7) - at[p], w = kernel_value(kernel, d / 0.4),
                       y = values[static_cast<std::size_t>(i)];
          s0 += w, s1 += w * d, s2 += w * d * d, r0 += w * y, r1 += w * d * y;
        }
      }
      EXPECT_NEAR(out[p], (s2 * r0 - s1 * r1) / (s0 * s2 - s1 * s1), 1e-12);
    }
  }
}

TEST(LocalLinear, a_surface_equals_the_least_squares_fit_at_every_place) {
  constexpr int n = 14, m = 9;
  const Eigen::MatrixXd surface = random_symmetric(n);
  for (const SmoothingKernel kernel : all_kernels) {
    for (const Diagonal diagonal : {Diagonal::kept, Diagonal::left_out}) {
      LocalLinearSurface smoother(n, m, kernel, 0.23, diagonal);
      Eigen::MatrixXd out;
      smoother.smooth(surface, out);
      ASSERT_EQ(out.rows(), m);
      for (int i = 0; i < m; ++i) {
        for (int j = 0; j < m; ++j) {
          std::vector<Eigen::Vector3d> rows;
          std::vector<double> weights, values;
          for (int a = 0; a < n; ++a) {
            for (int b = 0; b < n; ++b) {
              const double s = place(a, n) - place(i, m), t = place(b, n) - place(j, m);
              const double w = kernel_value(kernel, s / 0.23) * kernel_value(kernel, t / 0.23);
              if (w == 0 || (a == b && diagonal == Diagonal::left_out)) continue;
              rows.emplace_back(1, s, t);
              weights.push_back(w);
              values.push_back(surface(a, b));
            }
          }
          EXPECT_NEAR(out(i, j), fit(rows, weights, values), 1e-10);
        }
      }
      EXPECT_EQ(out, out.transpose());
    }
  }
}

TEST(LocalLinear, a_smoother_can_be_used_again) {
  LocalLinearSurface smoother(20, 20, SmoothingKernel::epanechnikov, 0.2, Diagonal::left_out);
  const Eigen::MatrixXd a = random_symmetric(20), b = a * 2;
  Eigen::MatrixXd first, second, again;
  smoother.smooth(a, first);
  smoother.smooth(b, second);
  smoother.smooth(a, again);
  EXPECT_EQ(first, again);
  EXPECT_LE((second - 2 * first).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(LocalLinear, noise_on_the_diagonal_is_seen_only_when_the_diagonal_is_kept) {
  Eigen::MatrixXd plane(25, 25), noisy;
  for (int i = 0; i < 25; ++i) {
    for (int j = 0; j < 25; ++j) plane(i, j) = 2 + 0.5 * (place(i, 25) + place(j, 25));
  }
  noisy = plane;
  noisy.diagonal().array() += 100;
  Eigen::MatrixXd without, with;
  LocalLinearSurface(25, 25, SmoothingKernel::quartic, 0.2, Diagonal::left_out).smooth(noisy, without);
  LocalLinearSurface(25, 25, SmoothingKernel::quartic, 0.2, Diagonal::kept).smooth(noisy, with);
  EXPECT_LE((without - plane).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_GT((with - plane).cwiseAbs().maxCoeff(), 1);
}

TEST(LocalLinear, the_ridge_equals_the_least_squares_fit_across_the_diagonal) {
  constexpr int n = 15;
  const Eigen::MatrixXd surface = random_symmetric(n);
  const std::vector<double> at = {0.25, 0.5, 0.61};
  const double half = std::sqrt(0.5);
  for (const SmoothingKernel kernel : all_kernels) {
    const auto ridge = rotated_quadratic_ridge(surface, kernel, 0.25, at);
    for (std::size_t p = 0; p < at.size(); ++p) {
      std::vector<Eigen::Vector3d> rows;
      std::vector<double> weights, values;
      for (int a = 0; a < n; ++a) {
        for (int b = 0; b < n; ++b) {
          const double u = half * (place(a, n) - place(b, n)), v = half * (place(a, n) + place(b, n) - 2 * at[p]);
          const double w = kernel_value(kernel, u / 0.25) * kernel_value(kernel, v / 0.25);
          if (w == 0 || a == b) continue;
          rows.emplace_back(1, u * u, v);
          weights.push_back(w);
          values.push_back(surface(a, b));
        }
      }
      EXPECT_NEAR(ridge[p], fit(rows, weights, values), 1e-10);
    }
  }
}

TEST(LocalLinear, windows_with_too_few_points_are_an_error) {
  const std::vector<double> values(11, 1.0), at = {0.5};
  const SmoothingKernel kernel = SmoothingKernel::epanechnikov;
  for (const double bandwidth : {0.0, -1.0, 0.05, 0.1, std::nan("")}) {
    EXPECT_THROW((void)local_linear_line(values, {}, kernel, bandwidth, at), Error) << bandwidth;
    EXPECT_THROW((void)LocalLinearSurface(11, 11, kernel, bandwidth, Diagonal::kept), Error) << bandwidth;
    EXPECT_THROW((void)rotated_quadratic_ridge(Eigen::MatrixXd::Ones(11, 11), kernel, bandwidth, at), Error)
        << bandwidth;
  }
  EXPECT_THROW((void)local_linear_line(std::vector<double>{1}, {}, kernel, 0.5, at), Error);
  EXPECT_THROW((void)local_linear_line({}, {}, kernel, 0.5, at), Error);
}

}  // namespace
}  // namespace kinespace
