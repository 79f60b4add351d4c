// yoo2019's tables 7 and 8 and figure 9: how small motion vectors are, and how far off.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "bench/codec_papers.h"
#include "bench/plot.h"
#include "bench/space.h"
#include "kinespace/fpca/analytic_basis.h"
#include "kinespace/fpca/space_builder.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

constexpr int most_functions = 20;
constexpr int table_functions = 6;  // tables 7 and 8
constexpr float table_threshold = 1e-5F;
constexpr float figure_threshold = 1e-7F;

struct EncodedFile {
  Clip clip;
  EncodedClip encoded;
};

struct VectorSpace {
  std::vector<EncodedFile> files;
  std::optional<RegisteredSpace> space;
  // Of all sequences: squared norms left after so many functions, ours, Fourier's, Legendre's.
  std::array<std::vector<double>, 3> left;
  double curves = 0;  // in all sequences

  [[nodiscard]] double raw() const {
    double out = 0;
    for (const EncodedFile& file : files) out += raw_bytes(file.clip);
    return out;
  }
};

// The numbers that are stored of the first n functions of all sequences.
double stored(const EncodedClip& clip, int n, float threshold) {
  double out = 0;
  for (const EncodedRun& run : clip.runs) {
    for (const EncodedSequence& sequence : run.sequences) {
      const Eigen::Index rows = std::min<Eigen::Index>(n, sequence.scores.rows());
      out += static_cast<double>((sequence.scores.topRows(rows).array().abs() > threshold).count());
    }
  }
  return out;
}

void take_off(const CurveMatrix& coefficients, double energy, std::vector<double>& left) {
  left.resize(static_cast<std::size_t>(coefficients.cols()) + 1);
  left[0] += energy;
  for (Eigen::Index n = 0; n < coefficients.cols(); ++n) {
    energy -= coefficients.col(n).squaredNorm();
    left[static_cast<std::size_t>(n) + 1] += energy;
  }
}

VectorSpace analyse(const std::filesystem::path& folder) {
  std::vector<PreparedClip> prepared;
  VectorSpace out;
  for (const auto& file : find_motion_files({folder})) {
    out.files.push_back({.clip = read_clip(file), .encoded = {}});
    prepared.push_back(prepare(out.files.back().clip, {.most_cycles = 0}));
  }
  // The paper's own space: no ends apart, all motion cut at rests.
  SpaceBuildOptions options;
  options.space.pinned = false;
  options.space.functions = most_functions;
  BuiltSpace built = build_space(source_of(prepared), options);
  const AnalyticBasis fourier(AnalyticFamily::fourier, built.space.plain().points(), built.space.plain().points());
  const AnalyticBasis legendre(AnalyticFamily::legendre, built.space.plain().points(), built.space.plain().points());
  const FunctionGroup& group = built.space.plain().groups().front();
  for (std::size_t i = 0; i < prepared.size(); ++i) {
    ClipCurves curves = prepared[i].curves;
    built.space.apply_references(curves.values);
    out.files[i].encoded = encode(built.space, curves, prepared[i].runs, built.warps[i]);
    for (std::size_t r = 0; r < prepared[i].runs.size(); ++r) {
      const RunSampler sampler(curves.values, prepared[i].runs[r], curves.rate_hz);
      for (const EncodedSequence& sequence : out.files[i].encoded.runs[r].sequences) {
        const CurveMatrix rows =
            sampler.sample(sequence.first, sequence.last, sequence.warp, built.space.plain().points()).transpose();
        const CurveMatrix centred = rows.rowwise() - group.mean.transpose();
        const auto energy = [&](const CurveMatrix& m) { return (m.cwiseAbs2() * fourier.weights()).sum(); };
        take_off(sequence.scores.transpose().cast<double>(), energy(centred), out.left[0]);
        take_off(fourier.coefficients(rows), energy(rows), out.left[1]);
        take_off(legendre.coefficients(rows), energy(rows), out.left[2]);
        out.curves += static_cast<double>(rows.rows());
      }
    }
  }
  out.space.emplace(std::move(built.space));
  return out;
}

void add_clip_tables(const VectorSpace& data, BenchReport& report) {
  BenchTable table{.title = fmt::format("yoo2019, tables 7 and 8: motion vectors of {} functions, entries below {:.0e} "
                                        "left out (paper: ratio 19 to 63, distortion 0.2 to 1.1 %)",
                                        table_functions, table_threshold),
                   .columns = {"clip", "floats / vector bytes", "distortion rate (%, eq. 16)", "mean joint error (cm)"},
                   .rows = {}};
  for (const EncodedFile& file : data.files) {
    const Clip decoded = clip_from_curves(decode(*data.space, file.encoded, table_functions), file.clip.skeleton);
    const MotionError error = compare(file.clip, decoded);
    table.rows.push_back({file.clip.name,
                          raw_bytes(file.clip) / (4 * stored(file.encoded, table_functions, table_threshold)),
                          error.kg_time, error.mean_joint_error_cm});
  }
  report.tables.push_back(std::move(table));
}

void add_figure_9(const std::string& name, const VectorSpace& data, BenchReport& report) {
  BenchTable table{.title = "yoo2019, figure 9: ratio by number of functions, " + name +
                            " (paper: 50 with 5 functions, Fourier 9, Legendre 10)",
                   .columns = {"functions", "vectors only", "with the functions", "Fourier, same error",
                               "Legendre, same error", "error left (rms, curve units)"},
                   .rows = {}};
  Plot plot{.title = "yoo2019, figure 9: " + name,
            .x = {.label = "functions"},
            .y = {.label = "ratio (32-bit floats over bytes)", .logarithmic = true},
            .series = {{"ours", {}}, {"with functions", {}}, {"Fourier", {}}, {"Legendre", {}}}};
  const double raw = data.raw();
  for (int n = 1; n <= data.space->functions(); ++n) {
    double numbers = 0;
    for (const EncodedFile& file : data.files) numbers += stored(file.encoded, n, figure_threshold);
    const double error = data.left[0][static_cast<std::size_t>(n)];
    const auto analytic = [&](const std::vector<double>& left) {
      const auto needed = std::ranges::find_if(left, [&](double e) { return e <= error; }) - left.begin();
      return raw / (4 * std::max(1.0, static_cast<double>(needed)) * data.curves);
    };
    const std::array<double, 4> ratios{raw / (4 * numbers),
                                       raw / (4 * (numbers + (n + 1.0) * data.space->plain().points())),
                                       analytic(data.left[1]), analytic(data.left[2])};
    table.rows.push_back({static_cast<double>(n), ratios[0], ratios[1], ratios[2], ratios[3],
                          std::sqrt(std::max(error, 0.0) / data.curves)});
    for (std::size_t s = 0; s < ratios.size(); ++s)
      plot.series[s].points.push_back({static_cast<double>(n), ratios[s]});
  }
  report.tables.push_back(std::move(table));
  report.pictures.push_back({"yoo2019-figure-9", to_svg(plot)});
}

}  // namespace

void add_yoo2019(const BenchOptions& options, BenchReport& report) {
  basis_rows(options, report);
  const VectorSpace data = analyse(options.data / "cmu");
  add_clip_tables(data, report);
  add_figure_9("cmu 01-03", data, report);
}

}  // namespace kinespace
