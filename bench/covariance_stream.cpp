#include "bench/covariance_stream.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <cblas.h>
#include <oneapi/tbb/global_control.h>

#include "bench/timing.h"
#include "kinespace/base/error.h"
#include "kinespace/kernels/covariance.h"

extern "C" void dsyevd_(const char* job, const char* half, const int* n, double* a, const int* stride, double* values,
                        double* work, const int* work_size, int* integers, const int* integers_size, int* status);

namespace kinespace {
namespace {

constexpr int kCurves = 1'000'000;
constexpr int kPoints = 128;
constexpr int kPart = 65'536;  // curves at a time: 32 MB
constexpr int kStreamRounds = 7;

// Sums of four cosines with scores from a small generator, and noise.
RowMatrix<float> make_curves() {
  constexpr int functions = 4;
  std::array<std::array<float, kPoints>, functions> waves{};
  for (int f = 0; f < functions; ++f) {
    for (int t = 0; t < kPoints; ++t) {
      waves[f][t] = static_cast<float>(std::cos(std::numbers::pi * f * t / (kPoints - 1)) / (1 + f));
    }
  }
  std::uint32_t state = 1;
  const auto uniform = [&] {
    state = state * 1664525U + 1013904223U;
    return static_cast<float>(state >> 8U) / 16777216.0F - 0.5F;
  };
  RowMatrix<float> out(kCurves, kPoints);
  for (Eigen::Index c = 0; c < kCurves; ++c) {
    std::array<float, functions> scores{};
    for (float& score : scores) score = uniform();
    for (int t = 0; t < kPoints; ++t) {
      float value = 0.01F * uniform();
      for (int f = 0; f < functions; ++f) value += scores[f] * waves[f][t];
      out(c, t) = value;
    }
  }
  return out;
}

// The largest eigenvalue; the matrix becomes the eigenvectors.
double eigenproblem(Eigen::MatrixXd& matrix) {
  const auto n = static_cast<int>(matrix.rows());
  const int work_size = 1 + 6 * n + 2 * n * n;
  const int integers_size = 3 + 5 * n;
  Eigen::VectorXd values(n);
  Eigen::VectorXd work(work_size);
  Eigen::VectorXi integers(integers_size);
  int status = 0;
  dsyevd_("V", "L", &n, matrix.data(), &n, values.data(), work.data(), &work_size, integers.data(), &integers_size,
          &status);
  if (status != 0) throw Error(ErrorKind::machine, {.found = "dsyevd status " + std::to_string(status)});
  return values[n - 1];
}

double stream(const RowMatrix<float>& curves, const Compute& compute) {
  CovarianceStream covariance(kPoints, BlockPrecision::single_precision, compute);
  for (Eigen::Index at = 0; at < curves.rows(); at += kPart) {
    covariance.add(curves.middleRows(at, std::min<Eigen::Index>(kPart, curves.rows() - at)));
  }
  auto result = covariance.result();
  return eigenproblem(result.covariance);
}

}  // namespace

std::vector<BenchResult> bench_covariance_stream(const Compute& device) {
  const RowMatrix<float> curves = make_curves();
  RowMatrix<float> product(kPoints, kPoints);
  use_single_threaded_blas();
  constexpr double flops = 1.0 * kCurves * kPoints * (kPoints + 1);
  constexpr double never = std::numeric_limits<double>::infinity();
  double bare = never;
  double ours = never;
  double on_device = never;
  double found = 0;  // so that no result is thrown away unseen
  const bool has_device = device.device_for(KernelFamily::dtw, never) != nullptr;
  // In turn, and the fastest of each: another process on the machine slows all of them.
  for (int round = 0; round < kStreamRounds; ++round) {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    bare = std::min(bare, seconds([&] {
                      cblas_ssyrk(CblasRowMajor, CblasLower, CblasTrans, kPoints, kCurves, 1, curves.data(), kPoints, 0,
                                  product.data(), kPoints);
                    }));
    ours = std::min(ours, seconds([&] { found += stream(curves, Compute()); }));
    if (has_device && device.choice() != "auto")
      on_device = std::min(on_device, seconds([&] { found += stream(curves, device); }));
  }
  const std::string data = "1 000 000 made curves x 128 points";
  const double rate = std::isfinite(found + product(0, 0)) ? flops * 1e-9 : std::nan("");
  std::vector<BenchResult> results{
      {.name = "bare SSYRK, one thread", .data = data, .value = rate / bare, .unit = "GFLOP/s"},
      {.name = "streamed covariance and its eigenproblem, one thread",
       .data = data,
       .value = rate / ours,
       .unit = "GFLOP/s"},
      {.name = "of the rate of bare SSYRK, one thread each",
       .data = data,
       .value = 100 * bare / ours,
       .unit = "%",
       .bar = 70,
       .higher_is_better = true}};
  if (std::isfinite(on_device)) {
    results.push_back({.name = "the same on the device", .data = data, .value = rate / on_device, .unit = "GFLOP/s"});
  }
  return results;
}

}  // namespace kinespace
