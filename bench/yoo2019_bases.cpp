// yoo2019's table 6 and figure 8: how many functions the same error takes - the functional PCA of the curves, Fourier
// series, Legendre polynomials - and what the three make of a sharp change.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "bench/curve_errors.h"
#include "bench/plot.h"
#include "bench/yoo2019_paper.h"
#include "bench/yoo2019_tables.h"
#include "kinespace/fpca/analytic_basis.h"

namespace kinespace {
namespace {

constexpr int components = 7;  // velocity x y z, quaternion w x y z
constexpr int whole_clip_points = 512;
constexpr int sequence_points = 128;
constexpr std::array<std::string_view, 3> basis_names{"Our method", "Fourier", "Legendre"};

// A stretch of a clip, sampled.
struct SampledPart {
  std::size_t clip = 0;
  double from_s = 0;
  double to_s = 0;
  SampleMatrix values;  // points x curves
};

std::vector<SampledPart> whole_clips(const PreparedSet& set, int points) {
  std::vector<SampledPart> out;
  for (std::size_t i = 0; i < set.prepared.size(); ++i) {
    const ClipCurves& curves = set.prepared[i].curves;
    const int last = curves.frames() - 1;
    const RunSampler sampler(curves.values, Run{{0, last}}, curves.rate_hz);
    out.push_back({i, 0, last / curves.rate_hz, sampler.sample(0, last, Warp(), points)});
  }
  return out;
}

std::vector<SampledPart> sequences(const PreparedSet& set, int points) {
  std::vector<SampledPart> out;
  for (std::size_t i = 0; i < set.prepared.size(); ++i) {
    const ClipCurves& curves = set.prepared[i].curves;
    for (const Run& run : set.prepared[i].runs) {
      const RunSampler sampler(curves.values, run, curves.rate_hz);
      for (int k = 0; k < run.sequence_count(); ++k) {
        const int first = run.first_frame(k), last = run.last_frame(k);
        out.push_back({i, first / curves.rate_hz, last / curves.rate_hz, sampler.sample(first, last, Warp(), points)});
      }
    }
  }
  return out;
}

// Which columns of the samples belong to a component.
std::vector<Eigen::Index> columns_of(int component, Eigen::Index columns) {
  std::vector<Eigen::Index> out;
  for (Eigen::Index c = 0; c < columns; ++c) {
    if (CurveLayout::component(static_cast<int>(c)) == component) out.push_back(c);
  }
  return out;
}

// The curves of one component, one a row, part after part.
CurveMatrix component_curves(const std::vector<SampledPart>& parts, int component) {
  const auto columns = columns_of(component, parts.front().values.cols());
  CurveMatrix out(static_cast<Eigen::Index>(parts.size() * columns.size()), parts.front().values.rows());
  Eigen::Index row = 0;
  for (const SampledPart& part : parts) {
    for (const Eigen::Index column : columns) out.row(row++) = part.values.col(column).transpose();
  }
  return out;
}

// What curves are in one basis: mean + coefficients x functions.
struct Expansion {
  Eigen::RowVectorXd mean;
  CurveMatrix coefficients;
  CurveMatrix functions;  // one a row, orthonormal under the trapezoid rule

  [[nodiscard]] CurveMatrix decode(const CurveView& chosen, Eigen::Index count) const {
    return (chosen.leftCols(count) * functions.topRows(count)).rowwise() + mean;
  }
};

// The curves of one component in the three bases.
struct ComponentBases {
  CurveMatrix curves;
  Eigen::VectorXd weights;
  std::array<Expansion, basis_names.size()> bases;
  Eigen::VectorXd shares;  // of variance, by number of functions, ours
  double rms = 0;          // of the curves

  [[nodiscard]] CurveErrors errors(const Expansion& basis, Eigen::Index count) const {
    CurveErrors out;
    out.add(curves, basis.decode(basis.coefficients, count), weights);
    return out;
  }
};

Expansion expand(const AnalyticBasis& basis, const CurveMatrix& curves) {
  return {Eigen::RowVectorXd::Zero(curves.cols()), basis.coefficients(curves), basis.functions().transpose()};
}

ComponentBases expand_component(CurveMatrix curves) {
  const int points = static_cast<int>(curves.cols());
  const FunctionalPca pca = fit_functional_pca(curves, {.variance_share = 1.0});
  ComponentBases out{
      .curves = std::move(curves), .weights = trapezoid_weights(points, 1), .shares = pca.cumulative_shares};
  out.bases = {Expansion{pca.observed_mean.transpose(), pca.scores(out.curves), pca.observed_functions.transpose()},
               expand(AnalyticBasis(AnalyticFamily::fourier, points, points), out.curves),
               expand(AnalyticBasis(AnalyticFamily::legendre, points, points), out.curves)};
  out.rms = std::sqrt((out.curves.cwiseAbs2() * out.weights).mean());
  return out;
}

// The fewest functions with which the 90th percentile of the errors keeps to the tolerance. Parseval tells where to
// look, decoding decides.
struct FunctionsNeeded {
  Eigen::Index count = 0;
  double error = 0;  // the 90th percentile, measured
};

Eigen::Index needed_by_parseval(const ComponentBases& data, const Expansion& basis, double tolerance) {
  Eigen::VectorXd energy = (data.curves.rowwise() - basis.mean).cwiseAbs2() * data.weights;
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(0.9 * static_cast<double>(energy.size()))) - 1;
  std::vector<double> left(static_cast<std::size_t>(energy.size()));
  for (Eigen::Index n = 0; n < basis.coefficients.cols(); ++n) {
    std::ranges::copy(energy, left.begin());
    std::ranges::nth_element(left, left.begin() + rank);
    if (left[static_cast<std::size_t>(rank)] <= tolerance * tolerance) return n;
    energy -= basis.coefficients.col(n).cwiseAbs2();
  }
  return basis.coefficients.cols();
}

FunctionsNeeded functions_needed(const ComponentBases& data, const Expansion& basis, double tolerance) {
  const auto measured = [&](Eigen::Index n) { return data.errors(basis, n).percentile(0.9); };
  FunctionsNeeded out{.count = needed_by_parseval(data, basis, tolerance)};
  out.error = measured(out.count);
  while (out.error > tolerance && out.count < basis.coefficients.cols()) out.error = measured(++out.count);
  return out;
}

// Over the components, for one tolerance.
struct BasisTotals {
  double tolerance = 0;  // of the curves' root mean square
  std::array<double, basis_names.size()> functions{};
  std::array<double, basis_names.size()> errors{};  // the largest of the components', measured, over the rms
};

void add_component(const ComponentBases& data, BasisTotals& totals) {
  if (data.rms == 0) return;  // nothing moves: no functions in any basis
  for (std::size_t b = 0; b < basis_names.size(); ++b) {
    const FunctionsNeeded needed = functions_needed(data, data.bases[b], totals.tolerance * data.rms);
    totals.functions[b] += static_cast<double>(needed.count);
    totals.errors[b] = std::max(totals.errors[b], needed.error / data.rms);
  }
}

struct BasisData {
  std::string name;
  std::vector<SampledPart> parts;
  std::array<BasisTotals, 3> totals{BasisTotals{0.05}, BasisTotals{0.02}, BasisTotals{0.01}};
};

void add_basis_bars(const BasisData& data, bool judged, BenchReport& report) {
  constexpr std::array<double, basis_names.size()> bars{0, 1.0 / 4, 1.0 / 3};
  for (const BasisTotals& totals : data.totals) {
    for (std::size_t b = 1; b < basis_names.size(); ++b) {
      if (totals.functions[b] == 0) continue;
      report.results.push_back(
          {.name = fmt::format("table 6: functions, ours over {}, 90th percentile within {} % of the rms",
                               basis_names[b], 100 * totals.tolerance),
           .data = data.name,
           .value = totals.functions[0] / totals.functions[b],
           .unit = "x",
           .bar = judged ? std::optional(bars[b]) : std::nullopt});
    }
  }
}

void add_basis_rows(const BasisData& data, BenchTable& table) {
  for (const BasisTotals& totals : data.totals) {
    std::vector<BenchCell> row{data.name, 100 * totals.tolerance};
    for (const double functions : totals.functions) row.emplace_back(functions);
    for (const double error : totals.errors) row.emplace_back(100 * error);
    table.rows.push_back(std::move(row));
  }
}

BenchTable empty_table_6(const PreparedSet& set) {
  BenchTable out{
      .title = "yoo2019, table 6: comparison of the required number of basis functions, all components, " + set.name,
      .columns = {"curves", "90th percentile error (% of rms)", "our method", "Fourier", "Legendre",
                  "measured (%), ours", "Fourier", "Legendre"},
      .rows = {},
      .notes = {"The paper does not tell the error that it asked for."}};
  std::vector<BenchCell> paper{"paper: Total", {}};
  for (const std::string_view name : basis_names) paper.emplace_back(paper_number(6, "Total", name));
  paper.resize(out.columns.size());
  out.rows.push_back(std::move(paper));
  return out;
}

// A rotation curve, and its largest second difference over 0.1 s.
struct SharpCurve {
  double size = 0;
  std::size_t part = 0;
  Eigen::Index column = 0;
  bool operator<(const SharpCurve& other) const {
    return std::tie(size, part, column) < std::tie(other.size, other.part, other.column);
  }
};

double sharpest_change(const SampledPart& part, Eigen::Index column) {
  const auto& curve = part.values.col(column);
  const Eigen::Index last = curve.size() - 1;
  if (part.to_s <= part.from_s) return 0;
  const double steps = 0.05 * static_cast<double>(last) / (part.to_s - part.from_s);
  const Eigen::Index step = std::clamp<Eigen::Index>(std::lround(steps), 1, last / 2);
  const Eigen::Index middles = curve.size() - 2 * step;
  return (curve.head(middles) - 2 * curve.segment(step, middles) + curve.tail(middles)).cwiseAbs().maxCoeff();
}

// Sharper than 999 of 1000 of all curves: the sharpest of all is as a rule a fault of the recording.
SharpCurve find_sharp_curve(const std::vector<SampledPart>& parts) {
  std::vector<SharpCurve> all;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (Eigen::Index c = 3; c < parts[i].values.cols(); ++c) all.push_back({sharpest_change(parts[i], c), i, c});
  }
  if (all.empty()) return {};
  const auto at = all.begin() + static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(all.size() - 1));
  std::ranges::nth_element(all, at, std::less());
  return *at;
}

// The row of a curve among those of its component.
Eigen::Index row_of(const SharpCurve& curve, Eigen::Index columns) {
  const auto all = columns_of(CurveLayout::component(static_cast<int>(curve.column)), columns);
  const auto own = std::ranges::find(all, curve.column) - all.begin();
  return static_cast<Eigen::Index>(curve.part * all.size()) + own;
}

// One curve as a basis gives it back.
struct DecodedCurve {
  std::string name;
  Eigen::Index functions = 0;
  Eigen::RowVectorXd values;
  double error = 0;  // measured
};

DecodedCurve decode_row(const ComponentBases& data, std::size_t basis, Eigen::Index row, Eigen::Index count) {
  DecodedCurve out{.name = std::string(basis_names[basis]), .functions = count};
  const CurveMatrix decoded = data.bases[basis].decode(data.bases[basis].coefficients.row(row), count);
  out.values = decoded.row(0);
  CurveErrors error;
  error.add(data.curves.row(row), decoded, data.weights);
  out.error = error.largest();
  return out;
}

// Section 7.2 and figure 8: ours with the functions for 0.999 of the component's variance, the others with as many as its
// error on this curve takes.
std::vector<DecodedCurve> decode_alike(const ComponentBases& data, Eigen::Index row) {
  const auto reached = std::ranges::find_if(data.shares, [](double share) { return share >= 0.999; });
  const Eigen::Index count = std::min<Eigen::Index>(reached - data.shares.begin() + 1, data.shares.size());
  std::vector<DecodedCurve> out{decode_row(data, 0, row, count)};
  for (const std::size_t basis : {std::size_t{2}, std::size_t{1}}) {
    const Eigen::Index all = data.bases[basis].coefficients.cols();
    Eigen::Index n = 1;
    while (n < all && decode_row(data, basis, row, n).error > out.front().error) ++n;
    out.push_back(decode_row(data, basis, row, n));
  }
  return out;
}

double total_variation(const Eigen::RowVectorXd& values) {
  return (values.tail(values.size() - 1) - values.head(values.size() - 1)).cwiseAbs().sum();
}

PlotSeries series_over(const SampledPart& part, const std::string& name, const Eigen::RowVectorXd& values) {
  PlotSeries out{.name = name, .points = {}, .dots = false};
  for (Eigen::Index t = 0; t < values.size(); ++t) {
    const double share = static_cast<double>(t) / static_cast<double>(values.size() - 1);
    out.points.push_back({part.from_s + share * (part.to_s - part.from_s), values(t)});
  }
  return out;
}

std::string figure_8(const std::string& title, const std::string& what, const SampledPart& part,
                     const Eigen::RowVectorXd& original, const std::vector<DecodedCurve>& decoded,
                     const Eigen::RowVectorXd& less) {
  Plot plot{.title = title,
            .x = {.label = "time (s)"},
            .y = {.label = what},
            .series = {series_over(part, "original", original - less)}};
  for (const DecodedCurve& curve : decoded) {
    plot.series.push_back(series_over(part, fmt::format("{} ({})", curve.name, curve.functions), curve.values - less));
  }
  return to_svg(plot);
}

std::string curve_name(const PreparedSet& set, const SampledPart& part, Eigen::Index column) {
  const Clip& clip = set.clips[part.clip];
  const CurveLayout layout = curve_layout(clip.skeleton);
  const auto joint = static_cast<std::size_t>(layout.joints[static_cast<std::size_t>((column - 3) / 4)]);
  return fmt::format("{}, {}, {}", clip.name, clip.skeleton.joints[joint].name, "wxyz"[(column - 3) % 4]);
}

// `data`: all curves of the sharp one's component, of sequences.
void add_figure_8(const PreparedSet& set, const std::vector<SampledPart>& parts, const SharpCurve& sharp,
                  const ComponentBases& data, BenchReport& report) {
  const SampledPart& part = parts[sharp.part];
  const Eigen::Index row = row_of(sharp, part.values.cols());
  const Eigen::RowVectorXd original = data.curves.row(row);
  const std::vector<DecodedCurve> decoded = decode_alike(data, row);
  const std::string curve = curve_name(set, part, sharp.column);
  BenchTable table{
      .title =
          fmt::format("yoo2019, figure 8: near a sharp change, {} from {:.2f} s, {}", curve, part.from_s, set.name),
      .columns = {"basis", "functions", "error of this curve (eq. 2)", "variation of the error over the curve's"},
      .rows = {},
      .notes = {"The curve changes more sharply than 999 of 1000 of the sequences' rotation curves. Functions of ours: "
                "0.999 of the variance of all curves of its component, sequences at 128 points; the others: as many as "
                "the same error on this curve takes.",
                "Variation: the sum of all changes from point to point; an error that oscillates has a large one."}};
  for (const DecodedCurve& one : decoded) {
    table.rows.push_back({one.name, static_cast<double>(one.functions), one.error,
                          total_variation(one.values - original) / total_variation(original)});
  }
  report.tables.push_back(std::move(table));
  const std::string title = fmt::format("yoo2019, figure 8: {}", curve);
  const std::string file = "yoo2019-figure-8-" + picture_name(set.name);
  const Eigen::RowVectorXd nothing = Eigen::RowVectorXd::Zero(original.size());
  report.pictures.push_back(
      {file, figure_8(title, "quaternion component (no unit)", part, original, decoded, nothing)});
  report.pictures.push_back({file + "-errors", figure_8(title + ", errors", "decoded less original (no unit)", part,
                                                        original, decoded, original)});
}

}  // namespace

void add_basis_tables(const PreparedSet& set, bool judged, BenchReport& report) {
  BenchTable table = empty_table_6(set);
  BenchReport figure;
  BasisData whole{.name = fmt::format("{}, whole clips, {} points", set.name, whole_clip_points),
                  .parts = whole_clips(set, whole_clip_points)};
  BasisData short_ones{.name = fmt::format("{}, sequences of about 1 s, {} points", set.name, sequence_points),
                       .parts = sequences(set, sequence_points)};
  const SharpCurve sharp = find_sharp_curve(short_ones.parts);
  for (BasisData* data : {&whole, &short_ones}) {
    for (int component = 0; component < components; ++component) {
      const ComponentBases bases = expand_component(component_curves(data->parts, component));
      for (BasisTotals& totals : data->totals) add_component(bases, totals);
      if (data == &short_ones && sharp.size > 0 &&
          component == CurveLayout::component(static_cast<int>(sharp.column))) {
        add_figure_8(set, data->parts, sharp, bases, figure);
      }
    }
    add_basis_rows(*data, table);
  }
  add_basis_bars(whole, judged, report);
  report.tables.push_back(std::move(table));
  std::ranges::move(figure.tables, std::back_inserter(report.tables));
  std::ranges::move(figure.pictures, std::back_inserter(report.pictures));
}

}  // namespace kinespace
