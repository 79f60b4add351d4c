// yoo2019's tables 3 to 5: the smoothed analysis of 210 and of 6510 curves, error and time.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "bench/curve_errors.h"
#include "bench/golden.h"
#include "bench/middle_seconds.h"
#include "bench/timing.h"
#include "bench/yoo2019_paper.h"
#include "bench/yoo2019_tables.h"

namespace kinespace {
namespace {

constexpr std::array<Eigen::Index, 2> test_cases{210, 6510};  // curves

struct SmoothingFigures {
  double average = 0;
  double largest = 0;
  std::optional<double> seconds;
};

// One for each test case.
struct SmoothingRow {
  std::string implementation;
  std::array<std::optional<SmoothingFigures>, 2> cases;
};

SmoothingFigures errors_of(const CurveMatrix& curves, const CurveMatrix& decoded) {
  CurveErrors errors;
  errors.add(curves, decoded, trapezoid_weights(static_cast<int>(curves.cols()), 1));
  return {.average = errors.average(), .largest = errors.largest(), .seconds = {}};
}

// Functions and scores, on one thread; the fastest of a few rounds: other processes only slow it down.
SmoothingFigures analyse_curves(const CurveMatrix& curves, const FpcaOptions& options, Domain domain = {}) {
  constexpr int rounds = 5;
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  double best = std::numeric_limits<double>::infinity();
  CurveMatrix decoded;
  for (int round = 0; round < rounds; ++round) {
    FunctionalPca pca;
    CurveMatrix scores;
    best = std::min(best, seconds([&] {
                      pca = fit_functional_pca(curves, options, domain);
                      scores = pca.scores(curves);
                    }));
    if (round == 0) decoded = pca.reconstruct(scores);
  }
  SmoothingFigures out = errors_of(curves, decoded);
  out.seconds = best;
  return out;
}

// The middle seconds of every so many clips, so that all of the set's contents are among them; nothing for a set that
// has too few.
std::optional<CurveMatrix> spread_curves(const PreparedSet& set, Eigen::Index count) {
  const auto each = static_cast<std::size_t>(set.prepared.front().curves.values.cols() - 3);
  const std::size_t wanted = (static_cast<std::size_t>(count) + each - 1) / std::max<std::size_t>(each, 1);
  const std::size_t stride = std::max<std::size_t>(1, set.prepared.size() / std::max<std::size_t>(wanted, 1));
  CurveMatrix out(count, middle_second_points);
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < set.prepared.size() && row < count; i += stride) {
    row = add_middle_second(set.prepared[i].curves, out, row);
  }
  if (row < count) return {};
  return out;
}

// The case of so many curves that fdapace smoothed and scored by conditional expectation, on the curves' own grid.
std::optional<GoldenCase> smoothed_golden_case(const std::filesystem::path& folder, Eigen::Index curves) {
  for (const auto& path : find_golden_cases(folder)) {
    GoldenCase golden = read_golden_case(path);
    const bool whole = golden.tables.contains("mu_workGrid") && golden.tables.contains("phi_workGrid") &&
                       golden.tables.contains("xiEst") &&
                       golden.tables.at("phi_workGrid").rows() == golden.curves.cols();
    if (golden.curves.rows() == curves && whole && golden.options.smooth_covariance &&
        golden.options.scores == ScoreKind::conditional) {
      return golden;
    }
  }
  return {};
}

// From the mean, the functions and the scores that the package left.
CurveMatrix decoded_by_package(const GoldenCase& golden) {
  const Eigen::RowVectorXd mean = golden.tables.at("mu_workGrid").reshaped().transpose();
  const CurveMatrix movement = golden.tables.at("xiEst") * golden.tables.at("phi_workGrid").transpose();
  return movement.rowwise() + mean;
}

void add_golden_rows(const GoldenCase& golden, std::vector<SmoothingRow>& rows) {
  rows.push_back({"fdapace (R), its own curves", {errors_of(golden.curves, decoded_by_package(golden)), std::nullopt}});
  rows.push_back({"kinespace, pace mode, R's curves",
                  {analyse_curves(golden.curves, golden.options, golden.domain), std::nullopt}});
}

SmoothingRow row_of_set(const std::string& name, const PreparedSet& set, FpcaMode mode) {
  SmoothingRow out{name, {}};
  for (std::size_t c = 0; c < test_cases.size(); ++c) {
    const auto curves = spread_curves(set, test_cases[c]);
    FpcaOptions options = smoothed_fpca();
    options.mode = mode;
    if (curves) out.cases[c] = analyse_curves(*curves, options);
  }
  return out;
}

template <typename Figure>
BenchTable smoothing_table(int number, const std::string& title, const std::vector<SmoothingRow>& rows,
                           const Figure& figure) {
  BenchTable out{.title = fmt::format("yoo2019, table {}: {}", number, title),
                 .columns = {"implementation", "210 curves", "6510 curves"},
                 .rows = {}};
  for (const char* name : {"PACE", "Ours"}) {
    out.rows.push_back({fmt::format("paper: {}", name), paper_number(number, name, "210 curves"),
                        paper_number(number, name, "6510 curves")});
  }
  for (const SmoothingRow& row : rows) {
    std::vector<BenchCell> cells{row.implementation};
    for (const auto& one : row.cases) cells.emplace_back(one ? figure(*one) : std::optional<double>());
    out.rows.push_back(std::move(cells));
  }
  return out;
}

std::vector<std::string> why_empty(const PreparedSet& set, const std::optional<GoldenCase>& golden) {
  std::vector<std::string> out;
  if (golden) {
    out.push_back(fmt::format(
        "fdapace's results of 210 curves are those of {}; it left no times, and none of 6510 curves.", golden->name));
  } else {
    out.emplace_back("No rows of fdapace (R): no golden case of 210 smoothed curves was found (--golden).");
  }
  for (const Eigen::Index count : test_cases) {
    if (!spread_curves(set, count)) out.push_back(fmt::format("{} has fewer than {} curves.", set.name, count));
  }
  return out;
}

}  // namespace

void add_smoothing_tables(const PreparedSet& set, const std::optional<std::filesystem::path>& folder,
                          BenchReport& report) {
  const auto golden = folder ? smoothed_golden_case(*folder, test_cases.front()) : std::nullopt;
  std::vector<SmoothingRow> rows;
  if (golden) add_golden_rows(*golden, rows);
  rows.push_back(row_of_set("kinespace, pace mode", set, FpcaMode::pace));
  rows.push_back(row_of_set("kinespace", set, FpcaMode::consistent));
  const std::vector<std::string> notes = why_empty(set, golden);
  const auto add = [&](int number, const char* title, std::vector<std::string> also, const auto& figure) {
    BenchTable table = smoothing_table(number, fmt::format("{}, {}", title, set.name), rows, figure);
    table.notes = std::move(also);
    table.notes.insert(table.notes.end(), notes.begin(), notes.end());
    report.tables.push_back(std::move(table));
  };
  using Cell = std::optional<double>;
  add(3, "average error", {"Rotation curves of middle seconds, 100 points, 0.9999 of the variance."},
      [](const SmoothingFigures& f) { return Cell(f.average); });
  add(4, "max error", {}, [](const SmoothingFigures& f) { return Cell(f.largest); });
  add(5, "processing time (s)",
      {"Ours: functions and scores, one thread of the processor, fastest of 5 rounds. Paper: Xeon E5-1650, its PACE in "
       "Matlab, its own in C++ and CUDA on a GTX 970."},
      [](const SmoothingFigures& f) { return f.seconds; });
}

}  // namespace kinespace
