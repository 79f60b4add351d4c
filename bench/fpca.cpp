// `kinespace bench fpca`: how near pace mode is to the package, and what an analysis costs against its one big product.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <iterator>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <cblas.h>

#include "bench/covariance_stream.h"
#include "bench/golden.h"
#include "bench/middle_seconds.h"
#include "bench/report.h"
#include "bench/space.h"
#include "kinespace/fpca/functional_pca.h"
#include "kinespace/kernels/calibration.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

namespace fs = std::filesystem;

constexpr int curve_count = 6510;
constexpr int curve_points = middle_second_points;

struct Sample {
  CurveMatrix curves;
  std::string source;
};

std::vector<fs::path> motion_files(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (is_motion_file(entry.path())) out.push_back(entry.path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

// Every so many clips of bandai2, so that all its contents are among the curves; none when there are too few clips.
Eigen::Index fill_from_clips(const fs::path& folder, CurveMatrix& out) {
  const std::vector<fs::path> files = motion_files(folder);
  constexpr std::size_t clips_wanted = 90;
  const std::size_t stride = std::max<std::size_t>(1, files.size() / clips_wanted);
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < files.size() && row < out.rows(); i += stride) {
    const Clip clip = read_clip(files[i]);
    if (clip.frames >= 2) row = add_middle_second(clip_curves(clip), out, row);
  }
  return row;
}

// Smooth curves with noise, for machines without the data.
void fill_generated(CurveMatrix& out) {
  std::mt19937 generator(1);
  const auto uniform = [&] { return static_cast<double>(generator()) / 4294967296.0 - 0.5; };
  for (Eigen::Index i = 0; i < out.rows(); ++i) {
    std::array<double, 8> scores{};
    for (std::size_t k = 0; k < scores.size(); ++k) scores[k] = uniform() * std::pow(0.5, static_cast<double>(k));
    for (int t = 0; t < curve_points; ++t) {
      out(i, t) = 0.02 * uniform();
      for (std::size_t k = 0; k < scores.size(); ++k) {
        out(i, t) += scores[k] * std::cos(std::numbers::pi * static_cast<double>(k) * t / (curve_points - 1));
      }
    }
  }
}

Sample sample_curves(const BenchOptions& options) {
  Sample out{CurveMatrix(curve_count, curve_points), "bandai2"};
  if (fill_from_clips(options.data / "bandai2", out.curves) < out.curves.rows()) {
    fill_generated(out.curves);
    out.source = "generated";
  }
  out.source += ", " + std::to_string(curve_count) + " curves x " + std::to_string(curve_points) + " points";
  return out;
}

struct Times {
  std::vector<double> wall, processor;  // ms
};

// Processor time is that of all threads of this process, so a thread hidden in a library would count.
template <typename Work>
void time_once(Times& times, bool keep, const Work& work) {
  const std::clock_t processor_start = std::clock();
  const auto wall_start = std::chrono::steady_clock::now();
  work();
  const auto wall = std::chrono::steady_clock::now() - wall_start;
  const std::clock_t processor = std::clock() - processor_start;
  if (!keep) return;
  times.wall.push_back(std::chrono::duration<double, std::milli>(wall).count());
  times.processor.push_back(1e3 * static_cast<double>(processor) / CLOCKS_PER_SEC);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double fastest(const std::vector<double>& values) {
  return *std::min_element(values.begin(), values.end());
}

void product_alone(const CurveMatrix& curves, Eigen::MatrixXd& gram) {
  cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, curve_points, curve_count, 1, curves.data(), curve_points, 0,
              gram.data(), curve_points);
}

// The bar is on processor time: on a busy machine the wall clock of a long piece of work holds other processes' turns
// and that of a short one does not. The wall times stand beside it. All are run in turn, many times, on one thread.
void measure_speed(const BenchOptions& options, BenchReport& report) {
  const Sample sample = sample_curves(options);
  openblas_set_num_threads(1);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(curve_points, curve_points);
  FunctionalPcaWorkspace workspace(curve_points, smoothed_fpca());
  Times product, whole, reused;
  double used = 0;  // so that no result is thrown away unseen
  constexpr int warm_up = 5, repeats = 61;
  for (int i = 0; i < warm_up + repeats; ++i) {
    const bool keep = i >= warm_up;
    time_once(product, keep, [&] { product_alone(sample.curves, gram); });
    time_once(whole, keep,
              [&] { used += fit_functional_pca(sample.curves, smoothed_fpca()).scores(sample.curves)(0, 0); });
    time_once(reused, keep, [&] { used += workspace.fit(sample.curves).scores(sample.curves)(0, 0); });
  }
  const bool finite = std::isfinite(used + gram(0, 0));
  const auto add = [&](const char* name, double value, const char* unit, std::optional<double> bar = {}) {
    report.results.push_back(
        {.name = name, .data = sample.source, .value = finite ? value : std::nan(""), .unit = unit, .bar = bar});
  };
  const double product_ms = median(product.processor);
  add("bare DSYRK, median processor time", product_ms, "ms");
  add("smoothed FPCA, sigma^2, conditional scores, all included, median processor time", median(whole.processor), "ms");
  add("the same with its workspace reused", median(reused.processor), "ms");
  add("smoothed FPCA over bare DSYRK, one thread each", median(whole.processor) / product_ms, "x", 3);
  add("bare DSYRK, median wall time", median(product.wall), "ms");
  add("smoothed FPCA, median wall time", median(whole.wall), "ms");
  add("smoothed FPCA over bare DSYRK, median wall times", median(whole.wall) / median(product.wall), "x");
  add("smoothed FPCA over bare DSYRK, fastest wall times", fastest(whole.wall) / fastest(product.wall), "x");
}

// The worst of all cases for each quantity.
void compare_golden(const fs::path& folder, BenchReport& report) {
  std::map<std::string, GoldenDifference> worst;
  const std::vector<fs::path> cases = find_golden_cases(folder);
  for (const fs::path& path : cases) {
    const GoldenCase golden = read_golden_case(path);
    const FunctionalPca ours = fit_functional_pca(golden.curves, golden.options, golden.domain);
    for (const GoldenDifference& difference : compare_with_golden(golden, ours)) {
      const auto [entry, first] = worst.try_emplace(difference.quantity, difference);
      if (!first && !(difference.relative <= entry->second.relative)) entry->second = difference;
    }
  }
  for (const auto& [quantity, difference] : worst) {
    report.results.push_back({.name = "largest relative difference from the package: " + quantity,
                              .data = "golden, " + std::to_string(cases.size()) + " cases",
                              .value = difference.relative,
                              .unit = "",
                              .bar = difference.bar});
  }
}

}  // namespace

BenchReport bench_fpca(const BenchOptions& options) {
  const Compute compute = open_calibrated(options.device);
  BenchReport report{.bench = "fpca", .device = "", .threads = 2, .results = {}};
  if (const auto golden = find_golden_folder(options.golden)) compare_golden(*golden, report);
  measure_speed(options, report);
  std::ranges::copy(bench_covariance_stream(compute), std::back_inserter(report.results));
  space_rows(options, compute, report);
  report.device = compute.describe();
  report.kernels = compute.uses();
  return report;
}

}  // namespace kinespace
