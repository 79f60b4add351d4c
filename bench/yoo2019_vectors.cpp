// yoo2019's tables 7 and 8 and figure 9: how small motion vectors are, and how far off.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "bench/plot.h"
#include "bench/yoo2019_paper.h"
#include "bench/yoo2019_tables.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/fpca/analytic_basis.h"
#include "kinespace/motion/error_measures.h"

namespace kinespace {
namespace {

constexpr int most_functions = 20;
constexpr int table_functions = 6;  // tables 7 and 8
constexpr float table_threshold = 1e-5F;
constexpr float figure_threshold = 1e-7F;
constexpr std::size_t most_clip_rows = 50;  // of a set with more the least, the median and the largest
constexpr std::array<std::string_view, 8> paper_motions{"09_06", "13_29", "15_04", "17_08",
                                                        "17_10", "85_12", "86_02", "86_08"};

// A set in the paper's own space: no ends apart, all motion cut at rests.
struct VectorSpace {
  BuiltSpace built;
  std::vector<EncodedClip> encoded;
};

VectorSpace vector_space(const PreparedSet& set, const Compute& compute) {
  SpaceBuildOptions options;
  options.space.pinned = false;
  options.space.functions = most_functions;
  VectorSpace out{.built = build_space(source_of(set.prepared), options, compute), .encoded = {}};
  out.encoded = encode_all(set, out.built);
  return out;
}

// The first n functions of a clip without the entries that are not stored.
EncodedClip stored_part(EncodedClip clip, Eigen::Index n, float threshold) {
  for (EncodedRun& run : clip.runs) {
    for (EncodedSequence& sequence : run.sequences) {
      const Eigen::Index rows = sequence.scores.rows();
      sequence.scores.bottomRows(std::max<Eigen::Index>(rows - n, 0)).setZero();
      auto scores = sequence.scores.array();
      scores = (scores.abs() > threshold).select(scores, 0);
    }
  }
  return clip;
}

double stored_numbers(const EncodedClip& part) {
  double out = 0;
  for (const EncodedRun& run : part.runs) {
    for (const EncodedSequence& sequence : run.sequences) {
      out += static_cast<double>((sequence.scores.array() != 0).count());
    }
  }
  return out;
}

struct ClipVector {
  std::string clip;
  double ratio = 0;       // 32-bit floats of all channels over those of the vector
  double distortion = 0;  // eq. 16, percent
};

std::vector<ClipVector> measure_vectors(const PreparedSet& set, const VectorSpace& space) {
  std::vector<ClipVector> out(set.clips.size());
  parallel_for(std::size_t{0}, out.size(), [&](std::size_t i) {
    const EncodedClip part = stored_part(space.encoded[i], table_functions, table_threshold);
    const Clip decoded = clip_from_curves(decode(space.built.space, part, table_functions), set.clips[i].skeleton);
    out[i] = {set.clips[i].name, raw_bytes(set.clips[i]) / (4 * std::max(1.0, stored_numbers(part))),
              compare(set.clips[i], decoded).kg_time};
  });
  return out;
}

// The paper's motions, then those of the data.
BenchTable vector_table(int number, const std::string& title, const std::vector<ClipVector>& vectors,
                        double ClipVector::*value) {
  constexpr std::array<std::string_view, 3> methods{"Liu and McMillan", "Tournier et al.", "Ours"};
  BenchTable out{.title = fmt::format("yoo2019, table {}: {}", number, title),
                 .columns = {"motion", "kinespace", "paper: ours", "Liu and McMillan 2006", "Tournier et al. 2009"},
                 .rows = {}};
  bool missing = false;
  for (const std::string_view motion : paper_motions) {
    const auto own = std::ranges::find(vectors, motion, &ClipVector::clip);
    const bool there = own != vectors.end();
    missing = missing || !there;
    out.rows.push_back({motion, there ? std::optional((*own).*value) : std::nullopt,
                        paper_number(number, methods[2], motion), paper_number(number, methods[0], motion),
                        paper_number(number, methods[1], motion)});
  }
  if (missing) out.notes.emplace_back("Motions of the paper without a number of ours are not among the clips given.");
  std::vector<double> values;
  for (const ClipVector& vector : vectors) values.push_back(vector.*value);
  std::ranges::sort(values);
  const auto add = [&](const std::string& name, double x) { out.rows.push_back({name, x, {}, {}, {}}); };
  add(fmt::format("least of {} clips", values.size()), values.front());
  add("median", values[values.size() / 2]);
  add("largest", values.back());
  for (const ClipVector& vector : vectors) {
    const bool paper = std::ranges::find(paper_motions, vector.clip) != paper_motions.end();
    if (vectors.size() <= most_clip_rows && !paper) add(vector.clip, vector.*value);
  }
  return out;
}

// Squared errors of curves after so many functions, ours (thresholded), Fourier's, Legendre's, summed over all curves;
// each from the curves less what the functions give back.
struct ErrorsLeft {
  std::array<std::vector<double>, 3> squares;
  double curves = 0;

  void add(const ErrorsLeft& other) {
    curves += other.curves;
    for (std::size_t b = 0; b < squares.size(); ++b) {
      squares[b].resize(std::max(squares[b].size(), other.squares[b].size()));
      for (std::size_t n = 0; n < other.squares[b].size(); ++n) squares[b][n] += other.squares[b][n];
    }
  }
};

// `left`: curves (a row each) less the mean; `functions`: one a row.
void take_off(CurveMatrix left, const CurveMatrix& coefficients, const CurveMatrix& functions,
              const Eigen::VectorXd& weights, std::vector<double>& squares) {
  squares.resize(static_cast<std::size_t>(coefficients.cols()) + 1);
  squares[0] += (left.cwiseAbs2() * weights).sum();
  for (Eigen::Index n = 0; n < coefficients.cols(); ++n) {
    left.noalias() -= coefficients.col(n) * functions.row(n);
    squares[static_cast<std::size_t>(n) + 1] += (left.cwiseAbs2() * weights).sum();
  }
}

ErrorsLeft errors_left(const PreparedSet& set, const VectorSpace& space) {
  const MotionSpace& plain = space.built.space.plain();
  const FunctionGroup& group = plain.groups().front();
  const AnalyticBasis fourier(AnalyticFamily::fourier, plain.points(), plain.points());
  const AnalyticBasis legendre(AnalyticFamily::legendre, plain.points(), plain.points());
  const CurveMatrix ours = group.functions.transpose();
  const std::array<CurveMatrix, 2> analytic{fourier.functions().transpose(), legendre.functions().transpose()};
  std::vector<ErrorsLeft> parts(set.prepared.size());
  parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
    const PreparedClip& clip = set.prepared[i];
    SampleMatrix values = clip.curves.values;
    plain.apply_references(values);
    const EncodedClip part = stored_part(space.encoded[i], most_functions, figure_threshold);
    for (std::size_t r = 0; r < clip.runs.size(); ++r) {
      const RunSampler sampler(values, clip.runs[r], clip.curves.rate_hz);
      for (const EncodedSequence& sequence : part.runs[r].sequences) {
        const CurveMatrix curves =
            sampler.sample(sequence.first, sequence.last, sequence.warp, plain.points()).transpose();
        take_off(curves.rowwise() - group.mean.transpose(), sequence.scores.transpose().cast<double>(), ours,
                 fourier.weights(), parts[i].squares[0]);
        take_off(curves, fourier.coefficients(curves), analytic[0], fourier.weights(), parts[i].squares[1]);
        take_off(curves, legendre.coefficients(curves), analytic[1], legendre.weights(), parts[i].squares[2]);
        parts[i].curves += static_cast<double>(curves.rows());
      }
    }
  });
  ErrorsLeft out;
  for (const ErrorsLeft& part : parts) out.add(part);
  return out;
}

void add_figure_9(const PreparedSet& set, const VectorSpace& space, BenchReport& report) {
  BenchTable table{
      .title = "yoo2019, figure 9: compression factor by number of basis functions, " + set.name,
      .columns = {"functions", "vectors only", "paper", "with the functions", "Fourier, same error", "paper",
                  "Legendre, same error", "paper", "error left (rms, curve units)"},
      .rows = {},
      .notes = {"32-bit floats of all channels over those stored; entries below 1e-7 are not. Paper: 227 MB "
                "of 321 motions at 120 Hz, 2605 sequences."}};
  Plot plot{.title = "yoo2019, figure 9: " + set.name,
            .x = {.label = "number of basis functions"},
            .y = {.label = "compression factor (raw bytes over stored)", .logarithmic = true},
            .series = {{"ours", {}}, {"Legendre", {}}, {"Fourier", {}}}};
  double raw = 0;
  for (const Clip& clip : set.clips) raw += raw_bytes(clip);
  const ErrorsLeft left = errors_left(set, space);
  const MotionSpace& plain = space.built.space.plain();
  for (int n = 1; n <= plain.functions(); ++n) {
    double numbers = 0;
    for (const EncodedClip& clip : space.encoded) numbers += stored_numbers(stored_part(clip, n, figure_threshold));
    const double error = left.squares[0][static_cast<std::size_t>(n)];
    const auto analytic = [&](const std::vector<double>& squares) {
      const auto needed = std::ranges::find_if(squares, [&](double e) { return e <= error; }) - squares.begin();
      return raw / (4 * std::max(1.0, static_cast<double>(needed)) * left.curves);
    };
    const double ours = raw / (4 * std::max(1.0, numbers));
    const double whole = raw / (4 * (numbers + (n + 1.0) * plain.points()));
    const double fourier = analytic(left.squares[1]);
    const double legendre = analytic(left.squares[2]);
    const auto paper = [&](const char* basis) { return paper_number(9, std::to_string(n), basis); };
    table.rows.push_back({static_cast<double>(n), ours, paper("Our method"), whole, fourier, paper("Fourier"), legendre,
                          paper("Legendre"), std::sqrt(error / left.curves)});
    const std::array<double, 3> drawn{ours, legendre, fourier};
    for (std::size_t s = 0; s < drawn.size(); ++s) plot.series[s].points.push_back({static_cast<double>(n), drawn[s]});
  }
  for (const auto& [basis, name] : {std::pair("Our method", "paper: ours"), std::pair("Legendre", "paper: Legendre"),
                                    std::pair("Fourier", "paper: Fourier")}) {
    if (const auto paper = paper_number(9, "5", basis)) plot.series.push_back({name, {{5, *paper}}});
  }
  report.tables.push_back(std::move(table));
  report.pictures.push_back({"yoo2019-figure-9-" + picture_name(set.name), to_svg(plot)});
}

}  // namespace

void add_vector_tables(const PreparedSet& set, const Compute& compute, BenchReport& report) {
  const VectorSpace space = vector_space(set, compute);
  const std::vector<ClipVector> vectors = measure_vectors(set, space);
  const std::string of =
      fmt::format("motion vectors of {} functions, entries below 1e-5 left out, {}", table_functions, set.name);
  report.tables.push_back(vector_table(7, "compression ratio, " + of, vectors, &ClipVector::ratio));
  report.tables.push_back(vector_table(8, "distortion rate (%), " + of, vectors, &ClipVector::distortion));
  add_figure_9(set, space, report);
}

}  // namespace kinespace
