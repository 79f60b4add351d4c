// How many functions the same error takes: the functional PCA of the curves, Fourier series, Legendre polynomials. Part
// of `kinespace bench fpca`.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

#include <fmt/format.h>

#include "bench/space.h"
#include "kinespace/fpca/analytic_basis.h"
#include "kinespace/fpca/space_builder.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

constexpr int components = 7;  // velocity x y z, quaternion w x y z

// The curves of each component, one a row.
using ComponentCurves = std::array<CurveMatrix, components>;

std::vector<PreparedClip> load_clips(const std::filesystem::path& folder) {
  std::vector<PreparedClip> out;
  for (const auto& file : find_motion_files({folder})) out.push_back(prepare(read_clip(file), {.most_cycles = 0}));
  return out;
}

ComponentCurves collect(const std::vector<SampleMatrix>& samples) {
  std::array<std::vector<Eigen::RowVectorXd>, components> rows;
  for (const SampleMatrix& s : samples) {
    for (Eigen::Index c = 0; c < s.cols(); ++c) {
      rows[static_cast<std::size_t>(CurveLayout::component(static_cast<int>(c)))].emplace_back(s.col(c).transpose());
    }
  }
  ComponentCurves out;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    out[k].resize(static_cast<Eigen::Index>(rows[k].size()), samples.front().rows());
    for (std::size_t i = 0; i < rows[k].size(); ++i) out[k].row(static_cast<Eigen::Index>(i)) = rows[k][i];
  }
  return out;
}

std::vector<SampleMatrix> whole_clips(const std::vector<PreparedClip>& clips, int points) {
  std::vector<SampleMatrix> out;
  for (const PreparedClip& clip : clips) {
    const int last = clip.curves.frames() - 1;
    out.push_back(RunSampler(clip.curves.values, Run{{0, last}}, clip.curves.rate_hz).sample(0, last, Warp(), points));
  }
  return out;
}

std::vector<SampleMatrix> sequences(const std::vector<PreparedClip>& clips, int points) {
  std::vector<SampleMatrix> out;
  for (const PreparedClip& clip : clips) {
    for (const Run& run : clip.runs) {
      const RunSampler sampler(clip.curves.values, run, clip.curves.rate_hz);
      for (int i = 0; i < run.sequence_count(); ++i) {
        out.push_back(sampler.sample(run.first_frame(i), run.last_frame(i), Warp(), points));
      }
    }
  }
  return out;
}

// The fewest functions with which the 90th percentile of the curves' root mean square errors is within the tolerance.
// `coefficients` are in an orthonormal basis, `energy` the squared norm of each curve in it.
int functions_needed(const CurveMatrix& coefficients, Eigen::VectorXd energy, double tolerance) {
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(0.9 * static_cast<double>(energy.size()))) - 1;
  std::vector<double> left(static_cast<std::size_t>(energy.size()));
  for (Eigen::Index n = 0; n <= coefficients.cols(); ++n) {
    if (n > 0) energy -= coefficients.col(n - 1).cwiseAbs2();
    std::ranges::copy(energy, left.begin());
    std::ranges::nth_element(left, left.begin() + rank);
    if (left[static_cast<std::size_t>(rank)] <= tolerance * tolerance) return static_cast<int>(n);
  }
  return static_cast<int>(coefficients.cols());
}

// All coefficients of the curves of one component, in the three bases.
struct Expansions {
  std::array<CurveMatrix, 3> values;  // ours, Fourier, Legendre
  std::array<Eigen::VectorXd, 3> energy;
  double rms = 0;  // of the curves
};

Expansions expand(const CurveMatrix& curves) {
  const int points = static_cast<int>(curves.cols());
  const AnalyticBasis fourier(AnalyticFamily::fourier, points, points);
  const AnalyticBasis legendre(AnalyticFamily::legendre, points, points);
  const FunctionalPca pca = fit_functional_pca(curves, {.variance_share = 1.0});
  const Eigen::VectorXd energy = curves.cwiseAbs2() * fourier.weights();
  const CurveMatrix centred = curves.rowwise() - pca.observed_mean.transpose();
  Expansions out;
  out.values = {pca.scores(curves), fourier.coefficients(curves), legendre.coefficients(curves)};
  out.energy = {centred.cwiseAbs2() * fourier.weights(), energy, energy};
  out.rms = std::sqrt(energy.mean());
  return out;
}

void add_rows(const std::string& data, const ComponentCurves& curves, bool bars, const std::vector<double>& tolerances,
              BenchReport& report) {
  std::vector<std::array<int, 3>> totals(tolerances.size(), {0, 0, 0});
  for (const CurveMatrix& component : curves) {
    const Expansions c = expand(component);
    for (std::size_t t = 0; t < tolerances.size(); ++t) {
      for (std::size_t b = 0; b < 3; ++b)
        totals[t][b] += functions_needed(c.values[b], c.energy[b], tolerances[t] * c.rms);
    }
  }
  for (std::size_t t = 0; t < tolerances.size(); ++t) {
    const std::string at = fmt::format(", 90th percentile within {} % of the rms", 100 * tolerances[t]);
    const auto [ours, fourier, legendre] = totals[t];
    const auto add = [&](const std::string& name, double value, const char* unit, std::optional<double> bar) {
      report.results.push_back({.name = name + at, .data = data, .value = value, .unit = unit, .bar = bar});
    };
    const bool judged = bars && t == 0;
    add("functions, ours (paper: 96)", ours, "functions", {});
    add("functions, Fourier (paper: 476)", fourier, "functions", {});
    add("functions, Legendre (paper: 293)", legendre, "functions", {});
    add("ours over Fourier", static_cast<double>(ours) / fourier, "x", judged ? std::optional(1.0 / 4) : std::nullopt);
    add("ours over Legendre", static_cast<double>(ours) / legendre, "x",
        judged ? std::optional(1.0 / 3) : std::nullopt);
  }
}

}  // namespace

void basis_rows(const BenchOptions& options, BenchReport& report) {
  const std::vector<PreparedClip> clips = load_clips(options.data / "cmu");
  add_rows("cmu 01-03, whole clips, 512 points", collect(whole_clips(clips, 512)), true, {0.05, 0.02, 0.01}, report);
  add_rows("cmu 01-03, 1 s sequences, 128 points", collect(sequences(clips, 128)), false, {0.05, 0.02, 0.01}, report);
}

}  // namespace kinespace
