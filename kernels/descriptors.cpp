#include <chrono>
#include <cmath>
#include <random>

#include "kinespace/kernels/covariance.h"
#include "kinespace/kernels/dtw.h"
#include "kinespace/kernels/kernel_descriptor.h"
#include "kinespace/kernels/keyframe_distance.h"
#include "kinespace/kernels/local_linear.h"
#include "kinespace/kernels/projection.h"

namespace kinespace {
namespace {

using Sizes = KernelDescriptor::Sizes;
using Comparison = KernelDescriptor::Comparison;

template <typename Call>
auto timed(double& seconds, const Call& call) {
  const auto start = std::chrono::steady_clock::now();
  auto result = call();
  seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

// Of each of so many calls.
template <typename Call>
std::vector<double> times_of(int rounds, const Call& call) {
  std::vector<double> out(static_cast<std::size_t>(rounds));
  for (double& seconds : out) static_cast<void>(timed(seconds, call));
  return out;
}

template <typename A, typename B>
double relative_error(const Eigen::MatrixBase<A>& found, const Eigen::MatrixBase<B>& expected) {
  if (found.rows() != expected.rows() || found.cols() != expected.cols()) return HUGE_VAL;
  if (expected.size() == 0) return 0;
  const double scale = static_cast<double>(expected.cwiseAbs().maxCoeff());
  const double error = static_cast<double>((found - expected).cwiseAbs().maxCoeff());
  return error == 0 ? 0 : error / scale;
}

// Rows with an offset far from 0, as poses have.
RowMatrix<float> random_rows(int rows, int columns, std::mt19937& random) {
  std::normal_distribution<float> normal;
  return RowMatrix<float>::NullaryExpr(rows, columns, [&] { return 3 + normal(random); });
}

double product(const Sizes& sizes) {
  double all = 1;
  for (const int size : sizes) all *= size;
  return all;
}

Comparison compare_distances(const Sizes& sizes, const Compute& compute, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto a = random_rows(sizes[0], sizes[2], random);
  const auto b = random_rows(sizes[1], sizes[2], random);
  Comparison out;
  const auto kind = DistanceKind::squared;
  const auto found = timed(out.kernel_seconds, [&] { return keyframe_distances(a, b, kind, compute); });
  const auto expected = timed(out.reference_seconds, [&] { return reference::keyframe_distances(a, b, kind); });
  out.error = relative_error(found, expected);
  return out;
}

// Clips of 0 to `longest` rows: random walks, so that near frames are alike.
FeatureSet random_walks(int clips, int longest, int dims, std::mt19937& random) {
  FeatureSet set{.dims = dims};
  std::uniform_int_distribution<int> length(std::max(1, longest / 8), std::max(1, longest));
  std::normal_distribution<float> normal;
  for (int c = 0; c < clips; ++c) {
    RowMatrix<float> rows =
        RowMatrix<float>::NullaryExpr(longest == 0 ? 0 : length(random), dims, [&] { return normal(random); });
    for (Eigen::Index i = 1; i < rows.rows(); ++i) rows.row(i) += rows.row(i - 1);
    set.add({rows.data(), static_cast<std::size_t>(rows.size())});
  }
  return set;
}

Comparison compare_dtw(const Sizes& sizes, const Compute& compute, const DtwOptions& options, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto clips = random_walks(sizes[0], sizes[1], sizes[2], random);
  const auto pairs = all_pairs(clips.clips());
  Comparison out;
  const auto found = timed(out.kernel_seconds, [&] { return dtw(clips, clips, pairs, options, compute); });
  const auto expected = timed(out.reference_seconds, [&] { return reference::dtw(clips, clips, pairs, options); });
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    if (found[p].found() != expected[p].found()) return {.error = HUGE_VAL};
    if (!found[p].found() || found[p].cost == expected[p].cost) continue;
    out.error = std::max(out.error, std::abs(found[p].cost - expected[p].cost) / expected[p].cost);
  }
  return out;
}

Comparison compare_covariance(const Sizes& sizes, const Compute& compute, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto curves = random_rows(sizes[0], sizes[1], random);
  Comparison out;
  const int lost = sizes[0] > 1 ? 1 : 0;
  if (sizes[0] == 0) return out;  // no covariance: a test of its own
  const auto precision = BlockPrecision::single_precision;
  const auto found = timed(out.kernel_seconds, [&] { return covariance(curves, lost, precision, compute); });
  const auto expected = timed(out.reference_seconds, [&] { return reference::covariance(curves, lost); });
  out.error = std::max(sizes[0] > 1 ? relative_error(found.covariance, expected.covariance) : 0,
                       relative_error(found.mean, expected.mean));
  return out;
}

Comparison compare_projection(const Sizes& sizes, const Compute& compute, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto curves = random_rows(sizes[0], sizes[1], random);
  const Eigen::VectorXf mean = Eigen::VectorXf::Constant(sizes[1], 2.5F);
  const auto functions = random_rows(sizes[1], sizes[2], random);
  Comparison out;
  const auto found = timed(out.kernel_seconds, [&] { return project(curves, mean, functions, compute); });
  const auto expected = timed(out.reference_seconds, [&] { return reference::project(curves, mean, functions); });
  out.error = relative_error(found, expected);
  return out;
}

Comparison compare_reconstruction(const Sizes& sizes, const Compute& compute, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto scores = random_rows(sizes[0], sizes[2], random);
  const Eigen::VectorXf mean = Eigen::VectorXf::Constant(sizes[1], 2.5F);
  const auto functions = random_rows(sizes[1], sizes[2], random);
  Comparison out;
  const auto found = timed(out.kernel_seconds, [&] { return reconstruct(scores, mean, functions, compute); });
  const auto expected = timed(out.reference_seconds, [&] { return reference::reconstruct(scores, mean, functions); });
  out.error = relative_error(found, expected);
  return out;
}

std::vector<double> time_distances(const Sizes& sizes, const Compute& compute, int rounds) {
  std::mt19937 random(1);
  const auto a = random_rows(sizes[0], sizes[2], random);
  const auto b = random_rows(sizes[1], sizes[2], random);
  return times_of(rounds, [&] { return keyframe_distances(a, b, DistanceKind::squared, compute); });
}

std::vector<double> time_dtw(const Sizes& sizes, const Compute& compute, int rounds) {
  std::mt19937 random(1);
  const auto clips = random_walks(sizes[0], sizes[1], sizes[2], random);
  const auto pairs = all_pairs(clips.clips());
  return times_of(rounds, [&] { return dtw(clips, clips, pairs, {}, compute); });
}

std::vector<double> time_covariance(const Sizes& sizes, const Compute& compute, int rounds) {
  std::mt19937 random(1);
  const auto curves = random_rows(sizes[0], sizes[1], random);
  return times_of(rounds, [&] { return covariance(curves, 1, BlockPrecision::single_precision, compute); });
}

std::vector<double> time_projection(const Sizes& sizes, const Compute& compute, int rounds) {
  std::mt19937 random(1);
  const auto curves = random_rows(sizes[0], sizes[1], random);
  const Eigen::VectorXf mean = Eigen::VectorXf::Constant(sizes[1], 2.5F);
  const auto functions = random_rows(sizes[1], sizes[2], random);
  return times_of(rounds, [&] { return project(curves, mean, functions, compute); });
}

KernelDescriptor distance_descriptor() {
  return {.name = "keyframe_distance",
          .family = KernelFamily::keyframe_distances,
          .size_names = {"n", "m", "features"},
          .test_sizes = {{0, 5, 3},
                         {5, 0, 3},
                         {5, 3, 0},
                         {1, 1, 1},
                         {4, 32, 16},
                         {3, 31, 15},
                         {5, 33, 17},
                         {63, 65, 7},
                         {64, 64, 64},
                         {129, 127, 130}},
          .bench_sizes = {1000, 1000, 128},
          .calibration_sizes = {{128, 128, 128}, {1500, 1500, 128}},
          .tolerance = 2e-6,
          .flops = [](const Sizes& s) { return 2 * product(s); },
          .bytes = [](const Sizes& s) { return 4.0 * (s[2] * (s[0] + s[1] * 1.0) + 1.0 * s[0] * s[1]); },
          .compare = compare_distances,
          .seconds = time_distances};
}

KernelDescriptor dtw_descriptor(std::string name, const DtwOptions& options) {
  return {.name = std::move(name),
          .family = KernelFamily::dtw,
          .size_names = {"clips", "longest", "features"},
          .test_sizes = {{0, 5, 3},
                         {1, 5, 3},
                         {3, 0, 2},
                         {2, 1, 1},
                         {5, 4, 16},
                         {17, 9, 15},
                         {18, 3, 17},
                         {19, 40, 5},
                         {6, 65, 33},
                         {4, 130, 64},
                         {33, 20, 2}},
          .bench_sizes = {100, 300, 128},
          .tolerance = 1e-5,
          // Half the pairs of clips of 9/16 of the longest on average; subtract, multiply, add.
          .flops = [](const Sizes& s) { return 0.5 * s[0] * s[0] * std::pow(9.0 / 16.0 * s[1], 2) * 3 * s[2]; },
          .bytes = [](const Sizes& s) { return 4.0 * 9.0 / 16.0 * product(s); },
          .compare = [options](const Sizes& sizes, const Compute& compute,
                               std::uint32_t seed) { return compare_dtw(sizes, compute, options, seed); }};
}

KernelDescriptor plain_dtw_descriptor() {
  KernelDescriptor plain = dtw_descriptor("dtw", {});
  plain.calibration_sizes = {{16, 100, 64}, {64, 200, 64}};
  plain.seconds = time_dtw;
  return plain;
}

KernelDescriptor covariance_descriptor() {
  return {.name = "covariance",
          .family = KernelFamily::covariance,
          .size_names = {"curves", "points"},
          .test_sizes = {{0, 3},
                         {1, 1},
                         {2, 1},
                         {3, 63},
                         {5, 64},
                         {63, 65},
                         {1023, 17},
                         {1024, 5},
                         {1025, 33},
                         {2049, 66},
                         {5000, 128},
                         {20, 257}},
          .bench_sizes = {65536, 128},
          .calibration_sizes = {{2048, 128}, {32768, 128}},
          .tolerance = 5e-6,
          .flops = [](const Sizes& s) { return 1.0 * s[0] * s[1] * (s[1] + 1); },
          .bytes = [](const Sizes& s) { return 4.0 * s[0] * s[1] + 8.0 * s[1] * s[1]; },
          .compare = compare_covariance,
          .seconds = time_covariance};
}

KernelDescriptor projection_descriptor(std::string name, decltype(&compare_projection) compare) {
  return {.name = std::move(name),
          .family = KernelFamily::projection,
          .size_names = {"curves", "points", "functions"},
          .test_sizes = {{0, 5, 2},
                         {5, 5, 0},
                         {1, 1, 1},
                         {4, 16, 32},
                         {3, 15, 31},
                         {5, 17, 33},
                         {65, 64, 63},
                         {257, 130, 20},
                         {300, 7, 129}},
          .bench_sizes = {100000, 128, 20},
          .tolerance = 5e-6,
          .flops = [](const Sizes& s) { return 2 * product(s); },
          .bytes = [](const Sizes& s) { return 4.0 * s[0] * (s[1] + s[2]) + 4.0 * s[1] * s[2]; },
          .compare = compare};
}

KernelDescriptor project_descriptor() {
  KernelDescriptor project = projection_descriptor("project", compare_projection);
  project.calibration_sizes = {{1000, 128, 20}, {40000, 128, 20}};
  project.seconds = time_projection;
  return project;
}

// A smooth symmetric surface with noise.
Eigen::MatrixXd noisy_surface(int points, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::MatrixXd out(points, points);
  for (int i = 0; i < points; ++i) {
    for (int j = 0; j <= i; ++j) out(i, j) = out(j, i) = std::cos(3.0 * (i - j) / points) + 0.1 * normal(random);
  }
  return out;
}

Comparison compare_surfaces(const Sizes& sizes, const Compute& compute, std::uint32_t seed) {
  std::mt19937 random(seed);
  const Eigen::MatrixXd surface = noisy_surface(sizes[0], random);
  const auto diagonal = seed % 2 == 0 ? Diagonal::kept : Diagonal::left_out;
  const double bandwidth = std::max(0.2, 2.5 / (sizes[0] - 1));
  LocalLinearSurface smoother(sizes[0], sizes[1], SmoothingKernel::epanechnikov, bandwidth, diagonal);
  Comparison out;
  Eigen::MatrixXd found;
  Eigen::MatrixXd expected;
  timed(out.kernel_seconds, [&] { return smoother.smooth(surface, found, compute), 0; });
  timed(out.reference_seconds, [&] { return smoother.smooth(surface, expected), 0; });
  out.error = relative_error(found, expected);
  return out;
}

std::vector<double> time_surfaces(const Sizes& sizes, const Compute& compute, int rounds) {
  std::mt19937 random(1);
  const Eigen::MatrixXd surface = noisy_surface(sizes[0], random);
  LocalLinearSurface smoother(sizes[0], sizes[1], SmoothingKernel::epanechnikov, 0.2, Diagonal::left_out);
  Eigen::MatrixXd found;
  return times_of(rounds, [&] { return smoother.smooth(surface, found, compute), 0; });
}

Comparison compare_lines(const Sizes& sizes, const Compute& compute, SmoothingKernel kernel, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.1, 1);
  std::vector<double> values(sizes[0]);
  std::vector<double> weights(seed % 2 == 0 ? 0 : values.size());
  std::vector<double> at(sizes[1]);
  for (auto* numbers : {&values, &weights, &at}) {
    for (double& number : *numbers) number = uniform(random);
  }
  const double bandwidth = std::max(0.15, 2.5 / (sizes[0] - 1));
  Comparison out;
  const auto found =
      timed(out.kernel_seconds, [&] { return local_linear_line(values, weights, kernel, bandwidth, at, compute); });
  const auto expected =
      timed(out.reference_seconds, [&] { return local_linear_line(values, weights, kernel, bandwidth, at); });
  out.error = relative_error(Eigen::VectorXd::Map(found.data(), static_cast<Eigen::Index>(found.size())),
                             Eigen::VectorXd::Map(expected.data(), static_cast<Eigen::Index>(expected.size())));
  return out;
}

KernelDescriptor surface_descriptor() {
  return {.name = "local_linear_surface",
          .family = KernelFamily::local_linear,
          .size_names = {"points", "out_points"},
          .test_sizes = {{4, 1}, {5, 4}, {15, 16}, {16, 15}, {17, 17}, {33, 100}, {101, 51}},
          .bench_sizes = {200, 200},
          .calibration_sizes = {{64, 64}, {400, 400}},
          .tolerance = 1e-11,
          .single_tolerance = 1e-4,
          .flops = [](const Sizes& s) { return 4.0 * product(s) * (s[0] + s[1]); },
          .bytes = [](const Sizes& s) { return 8.0 * (1.0 * s[0] * s[0] + 1.0 * s[1] * s[1]); },
          .compare = compare_surfaces,
          .seconds = time_surfaces};
}

KernelDescriptor line_descriptor(std::string name, SmoothingKernel kernel) {
  return {.name = std::move(name),
          .family = KernelFamily::local_linear,
          .size_names = {"points", "places"},
          .test_sizes = {{4, 0}, {4, 1}, {5, 15}, {16, 16}, {17, 17}, {100, 33}, {101, 100}},
          .bench_sizes = {1000, 1000},
          .tolerance = 1e-11,
          .single_tolerance = 1e-4,
          .flops = [](const Sizes& s) { return 12 * product(s); },
          .bytes = [](const Sizes& s) { return 8.0 * (2 * s[0] + 2 * s[1]); },
          .compare = [kernel](const Sizes& sizes, const Compute& compute,
                              std::uint32_t seed) { return compare_lines(sizes, compute, kernel, seed); }};
}

}  // namespace

std::vector<KernelDescriptor> kernel_descriptors() {
  const auto slopes = StepPattern::slope_limited;
  return {distance_descriptor(),
          plain_dtw_descriptor(),
          dtw_descriptor("dtw, path", {.want_path = true}),
          dtw_descriptor("dtw, band, squared", {.band_fraction = 0.1, .squared = true}),
          dtw_descriptor("dtw, slopes", {.steps = slopes}),
          dtw_descriptor("dtw, slopes, band, path", {.steps = slopes, .band_fraction = 0.2, .want_path = true}),
          covariance_descriptor(),
          project_descriptor(),
          projection_descriptor("reconstruct", compare_reconstruction),
          surface_descriptor(),
          line_descriptor("local_linear_line, epanechnikov", SmoothingKernel::epanechnikov),
          line_descriptor("local_linear_line, quartic", SmoothingKernel::quartic),
          line_descriptor("local_linear_line, gauss", SmoothingKernel::gauss)};
}

}  // namespace kinespace
