// yoo2019's tables 1 and 2: what registration is worth, and which curves should share functions.
#include <array>

#include <fmt/format.h>

#include "bench/curve_errors.h"
#include "bench/yoo2019_paper.h"
#include "bench/yoo2019_tables.h"
#include "kinespace/base/parallel.h"
#include "kinespace/motion/error_measures.h"

namespace kinespace {
namespace {

struct SpaceFigures {
  CurveErrors errors;
  double joint_error_cm = 0;  // mean over frames and joints
  double functions = 0;       // over all sets and groups
  double of_a_curve = 0;      // of the largest group
  double sequences = 0;
  double seconds_each = 0;
};

// Of the curves of all sequences of a clip, from the clip and from its vectors.
CurveErrors sequence_errors(const BuiltSpace& built, int number, const PreparedClip& clip, const EncodedClip& encoded) {
  SampleMatrix values = clip.curves.values;
  built.space.apply_references(values);
  const std::vector<Run> runs = built.runs_of(number, clip.runs);
  CurveErrors out;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RunSampler sampler(values, runs[r], clip.curves.rate_hz);
    for (const EncodedSequence& sequence : encoded.runs[r].sequences) {
      const MotionSpace& set = built.space.of(sequence.cycles);
      const SampleMatrix curves = sampler.sample(sequence.first, sequence.last, sequence.warp, set.points());
      out.add(curves.transpose(), set.samples(sequence.scores).transpose(), trapezoid_weights(set.points(), 1));
    }
  }
  return out;
}

SpaceFigures measure_space(const PreparedSet& set, const BuiltSpace& built) {
  const std::vector<EncodedClip> encoded = encode_all(set, built);
  std::vector<CurveErrors> errors(encoded.size());
  std::vector<double> joint_errors(encoded.size());
  parallel_for(std::size_t{0}, encoded.size(), [&](std::size_t i) {
    errors[i] = sequence_errors(built, static_cast<int>(i), set.prepared[i], encoded[i]);
    const Clip decoded = clip_from_curves(decode(built.space, encoded[i]), set.clips[i].skeleton);
    joint_errors[i] = compare(set.clips[i], decoded).mean_joint_error_cm * encoded[i].frames;
  });
  SpaceFigures out{.functions = static_cast<double>(built.space.function_count()),
                   .of_a_curve = static_cast<double>(built.space.functions())};
  double frames = 0;
  for (std::size_t i = 0; i < encoded.size(); ++i) {
    out.errors.add(errors[i]);
    out.joint_error_cm += joint_errors[i];
    frames += encoded[i].frames;
    out.sequences += encoded[i].sequence_count();
    out.seconds_each += encoded[i].frames / encoded[i].rate_hz;
  }
  out.joint_error_cm /= frames;
  out.seconds_each /= out.sequences;
  return out;
}

// The paper's own space: the ends of sequences are not kept apart.
SpaceBuildOptions paper_space(double variance_share) {
  SpaceBuildOptions out;
  out.space.pinned = false;
  out.space.variance_share = variance_share;
  return out;
}

const std::vector<std::string>& space_columns() {
  static const std::vector<std::string> columns{"",
                                                "average error",
                                                "paper",
                                                "variance of errors",
                                                "paper",
                                                "functions, over all groups",
                                                "paper",
                                                "largest error",
                                                "functions of a curve, at most",
                                                "sequences",
                                                "mean length (s)",
                                                "mean joint error (cm)"};
  return columns;
}

std::vector<BenchCell> space_row(int table, const std::string& name, const SpaceFigures& figures) {
  return {name,
          figures.errors.average(),
          paper_number(table, name, "Avg Error"),
          figures.errors.variance(),
          paper_number(table, name, "Var."),
          figures.functions,
          paper_number(table, name, "# of Basis Func"),
          figures.errors.largest(),
          figures.of_a_curve,
          figures.sequences,
          figures.seconds_each,
          figures.joint_error_cm};
}

void add_table_1(const PreparedSet& set, const Compute& compute, BenchReport& report) {
  constexpr double precision = 0.9999;
  BenchTable table{
      .title = "yoo2019, table 1: error and variance of FPCA before and after DTW (precision 0.9999), " + set.name,
      .columns = space_columns(),
      .rows = {}};
  const auto add = [&](const std::string& name, bool align, const SequenceOptions& sequences) {
    const PreparedSet cut = cut_again(set, sequences);
    SpaceBuildOptions options = paper_space(precision);
    options.align = align;
    table.rows.push_back(
        space_row(1, name, measure_space(cut, build_space(source_of(cut.prepared), options, compute))));
  };
  add("Before DTW", false, {.equal_windows = true});
  add("After DTW", true, {});
  table.notes = {
      "Before: equal windows at any phase, no warps. After: cut at whole cycles and at rests, with functions of their "
      "own for each kind of sequence, and warps where they win on clips held out; a sequence of cycles lasts longer.",
      "Paper: 41 motions of CMU."};
  report.tables.push_back(std::move(table));
}

void add_table_2(const PreparedSet& set, const Compute& compute, BenchReport& report) {
  struct Row {
    const char* name;
    Grouping grouping;
  };
  constexpr std::array<Row, 3> rows{{{"Per Component", Grouping::per_component},
                                     {"Per Joint Component", Grouping::per_joint_component},
                                     {"All Together", Grouping::all_together}}};
  BenchTable table{.title =
                       "yoo2019, table 2: average error, variance, and the required number of basis functions for "
                       "different configurations (0.999999 of the variance), " +
                       set.name,
                   .columns = space_columns(),
                   .rows = {}};
  for (const Row& row : rows) {
    SpaceBuildOptions options = paper_space(0.999999);
    options.space.grouping = row.grouping;
    options.align = false;  // table 1 says what warps are worth
    table.rows.push_back(
        space_row(2, row.name, measure_space(set, build_space(source_of(set.prepared), options, compute))));
  }
  table.notes = {fmt::format("{} curves a sequence, cut at rests, no warps; paper: 31 joints.",
                             set.prepared.front().curves.values.cols())};
  report.tables.push_back(std::move(table));
}

}  // namespace

void add_space_tables(const PreparedSet& set, const Compute& compute, BenchReport& report) {
  add_table_1(set, compute, report);
  add_table_2(set, compute, report);
}

}  // namespace kinespace
