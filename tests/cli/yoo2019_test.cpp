// `kinespace bench yoo2019` as a reader runs it: every table there, the paper's numbers where they belong, errors those
// that decoding by hand gives.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "kinespace/fpca/space_builder.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/cli/sample_clips.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr int golden_curves = 210;
constexpr int golden_points = 20;
constexpr double golden_offset = 0.125;  // of every curve from what the package's results give back

// A golden case of 210 curves a + b sin(pi t / 19) whose results are off by a constant: no analysis is needed to know the
// error that they have.
void write_golden_case(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::ofstream input(folder / "input.csv"), scores(folder / "xiEst.csv"), grid(folder / "obsGrid.csv");
  std::ofstream mean(folder / "mu_workGrid.csv"), functions(folder / "phi_workGrid.csv");
  const auto wave = [](int t) { return std::sin(3.14159265358979 * t / (golden_points - 1)); };
  for (int i = 0; i < golden_curves; ++i) {
    const double score = std::cos(0.7 * i);
    scores << fmt::format("{}\n", score);
    for (int t = 0; t < golden_points; ++t) {
      input << fmt::format("{}{}", t > 0 ? "," : "", 2 + golden_offset + score * wave(t));
    }
    input << '\n';
  }
  for (int t = 0; t < golden_points; ++t) {
    grid << fmt::format("{}\n", static_cast<double>(t) / (golden_points - 1));
    mean << "2\n";
    functions << fmt::format("{}\n", wave(t));
  }
  std::ofstream(folder / "scalars.csv") << "sigma2,NA\n";
  std::ofstream(folder / "options.txt")
      << "methodMuCovEst = smooth\nkernel = epan\nuserBwMu = 0.2\nuserBwCov = 0.2\nmethodXi = CE\nerror = TRUE\n"
         "shrink = FALSE\nFVEthreshold = 0.9999\nmethodSelectK = FVE\nmaxK = 10\nnRegGrid = 20\nmethodRho = vanilla\n";
}

class Yoo2019 : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    write_sample_clips(clips());
    // One of the paper's own names, so that its column has a number of ours.
    std::filesystem::copy_file(clips() / "walk_normal_001.bvh", clips() / "09_06.bvh");
    write_golden_case(*folder_ / "golden/case");
    const CommandResult result =
        run_command({"bench", "yoo2019", "--clips", clips().string(), "--golden", (*folder_ / "golden").string(),
                     "--pictures", pictures().string(), "--json", "--device", "cpu"});
    EXPECT_EQ(result.code, 0) << result.err;
    report_ = json::parse(result.out, nullptr, false);
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::filesystem::path clips() { return *folder_ / "clips"; }
  static std::filesystem::path pictures() { return *folder_ / "pictures"; }

  static const json& table(const std::string& start) {
    for (const json& one : report_.at("tables")) {
      if (one.at("title").get<std::string>().starts_with("yoo2019, " + start + ":")) return one;
    }
    ADD_FAILURE() << "no " << start;
    static const json none = {{"rows", json::array()}, {"columns", json::array()}, {"notes", json::array()}};
    return none;
  }
  // The cell of the row that begins with `name`.
  static json cell(const json& table, const std::string& name, std::size_t column) {
    for (const json& row : table.at("rows")) {
      if (row.at(0) == name) return row.at(column);
    }
    ADD_FAILURE() << "no row " << name;
    return {};
  }

  static std::unique_ptr<TemporaryFolder> folder_;
  static json report_;
};
std::unique_ptr<TemporaryFolder> Yoo2019::folder_;
json Yoo2019::report_;

// The set in the paper's space, built here.
struct PaperSpace {
  std::vector<Clip> clips;
  std::vector<PreparedClip> prepared;
  BuiltSpace built;

  [[nodiscard]] EncodedClip encoded(std::size_t i) const {
    ClipCurves curves = prepared[i].curves;
    built.space.apply_references(curves.values);
    return encode(built.space, curves, prepared[i].runs, built.warps[i]);
  }
};

PaperSpace paper_space(const std::filesystem::path& folder, std::optional<int> functions, bool align) {
  std::vector<Clip> clips;
  std::vector<PreparedClip> prepared;
  for (const auto& file : find_motion_files({folder})) {
    clips.push_back(read_clip(file));
    prepared.push_back(prepare(clips.back(), {.most_cycles = 0}));
  }
  SpaceBuildOptions options;
  options.space.pinned = false;
  options.space.functions = functions;
  options.align = align;
  BuiltSpace built = build_space(source_of(prepared), options);
  return {std::move(clips), std::move(prepared), std::move(built)};
}

TEST_F(Yoo2019, every_table_and_figure_is_there_and_its_cells_are_finite) {
  for (const char* start : {"table 1", "table 2", "table 3", "table 4", "table 5", "table 6", "table 7", "table 8",
                            "figure 8", "figure 9"}) {
    const json& one = table(start);
    EXPECT_GE(one.at("rows").size(), 2U) << start;
    for (const json& row : one.at("rows")) {
      ASSERT_EQ(row.size(), one.at("columns").size()) << start;
      for (const json& value : row) {
        EXPECT_TRUE(!value.is_number() || (std::isfinite(value.get<double>()) && value >= 0)) << start << row;
      }
    }
  }
  // What is not finite would be printed as null: nothing of ours is.
  for (const json& row : table("table 1").at("rows")) EXPECT_EQ(std::ranges::count(row, json()), 0) << row;
  for (const json& row : table("table 2").at("rows")) EXPECT_EQ(std::ranges::count(row, json()), 0) << row;
  for (const json& row : table("figure 8").at("rows")) EXPECT_EQ(std::ranges::count(row, json()), 0) << row;
}

TEST_F(Yoo2019, the_papers_numbers_stand_beside_ours) {
  EXPECT_EQ(cell(table("table 1"), "After DTW", 6), 6);
  EXPECT_EQ(cell(table("table 2"), "All Together", 2), 0.002255);
  EXPECT_EQ(cell(table("table 2"), "Per Joint Component", 6), 2032);
  EXPECT_EQ(cell(table("table 3"), "paper: Ours", 2), 0.00146001);
  EXPECT_EQ(cell(table("table 4"), "paper: PACE", 2), 0.20938692);
  EXPECT_EQ(cell(table("table 5"), "paper: PACE", 2), 784.9762);
  EXPECT_EQ(cell(table("table 6"), "paper: Total", 3), 476);
  EXPECT_EQ(cell(table("table 7"), "17_08", 4), 182);
  EXPECT_EQ(cell(table("table 8"), "09_06", 2), 1.11);
  EXPECT_EQ(table("figure 9").at("rows").at(4).at(2), 50);
}

TEST_F(Yoo2019, what_the_clips_cannot_show_is_null_with_a_note) {
  EXPECT_TRUE(cell(table("table 3"), "kinespace", 1).is_number());
  EXPECT_TRUE(cell(table("table 3"), "kinespace", 2).is_null());
  EXPECT_THAT(table("table 3").at("notes").dump(), HasSubstr("fewer than 6510 curves"));
  EXPECT_TRUE(cell(table("table 7"), "09_06", 1).is_number());
  EXPECT_TRUE(cell(table("table 7"), "13_29", 1).is_null());
  EXPECT_THAT(table("table 7").at("notes").dump(), HasSubstr("not among the clips"));
  EXPECT_TRUE(cell(table("table 5"), "fdapace (R), its own curves", 1).is_null());
  EXPECT_THAT(table("table 5").at("notes").dump(), HasSubstr("left no times"));
}

TEST_F(Yoo2019, errors_of_the_package_are_those_of_what_it_left) {
  EXPECT_NEAR(cell(table("table 3"), "fdapace (R), its own curves", 1), golden_offset, 1e-12);
  EXPECT_NEAR(cell(table("table 4"), "fdapace (R), its own curves", 1), golden_offset, 1e-12);
  EXPECT_LT(cell(table("table 3"), "kinespace, pace mode, R's curves", 1), 0.1 * golden_offset);
}

// Equations 10, 1 and 2 in plain loops over the functions of the space.
TEST_F(Yoo2019, errors_of_table_2_are_those_of_decoding_by_hand) {
  const PaperSpace paper = paper_space(clips(), {}, false);
  const MotionSpace& space = paper.built.space.plain();
  const FunctionGroup& group = space.groups().front();
  const int points = space.points();
  const auto weight = [&](int t) { return (t == 0 || t == points - 1 ? 0.5 : 1.0) / (points - 1); };
  double sum = 0, largest = 0;
  std::int64_t curves = 0;
  for (std::size_t i = 0; i < paper.prepared.size(); ++i) {
    const PreparedClip& clip = paper.prepared[i];
    SampleMatrix values = clip.curves.values;
    space.apply_references(values);
    const EncodedClip encoded = paper.encoded(i);
    for (std::size_t r = 0; r < clip.runs.size(); ++r) {
      const RunSampler sampler(values, clip.runs[r], clip.curves.rate_hz);
      for (const EncodedSequence& sequence : encoded.runs[r].sequences) {
        const SampleMatrix f = sampler.sample(sequence.first, sequence.last, sequence.warp, points);
        for (Eigen::Index c = 0; c < f.cols(); ++c, ++curves) {
          std::vector<double> left(static_cast<std::size_t>(points));
          for (int t = 0; t < points; ++t) left[static_cast<std::size_t>(t)] = f(t, c) - group.mean(t);
          for (Eigen::Index k = 0; k < group.functions.cols(); ++k) {
            double score = 0;
            for (int t = 0; t < points; ++t) score += weight(t) * (f(t, c) - group.mean(t)) * group.functions(t, k);
            // Functions that the sequence does not need are left out, and frames between the grid's points count, too.
            const auto kept = static_cast<double>(sequence.scores(k, c));
            const bool needed = !sequence.scores.row(k).isZero(0);
            EXPECT_NEAR(kept, needed ? score : 0, 3e-3) << k;
            for (int t = 0; t < points; ++t) left[static_cast<std::size_t>(t)] -= kept * group.functions(t, k);
          }
          double square = 0;
          for (int t = 0; t < points; ++t)
            square += weight(t) * left[static_cast<std::size_t>(t)] * left[static_cast<std::size_t>(t)];
          sum += std::sqrt(square);
          largest = std::max(largest, std::sqrt(square));
        }
      }
    }
  }
  const json& printed = table("table 2");
  EXPECT_NEAR(cell(printed, "All Together", 1), sum / static_cast<double>(curves),
              1e-3 * sum / static_cast<double>(curves));
  EXPECT_NEAR(cell(printed, "All Together", 7), largest, 1e-3 * largest);
  EXPECT_EQ(cell(printed, "All Together", 5), space.function_count());
  EXPECT_GT(cell(printed, "Per Component", 5), cell(printed, "Per Component", 8)) << "over all groups, not the largest";
}

TEST_F(Yoo2019, distortion_is_that_of_the_decoded_clip) {
  const PaperSpace paper = paper_space(clips(), 20, true);
  for (std::size_t i = 0; i < paper.clips.size(); ++i) {
    if (paper.clips[i].name != "jump_up_001") continue;
    const Clip decoded = clip_from_curves(decode(paper.built.space, paper.encoded(i), 6), paper.clips[i].skeleton);
    const double kg = compare(paper.clips[i], decoded).kg_time;
    ASSERT_GT(kg, 0.1);
    EXPECT_NEAR(cell(table("table 8"), "jump_up_001", 1), kg, 1e-3 * kg);
    return;
  }
  FAIL() << "no such sample";
}

TEST_F(Yoo2019, functions_of_table_6_keep_to_the_error_asked_for) {
  int rows = 0;
  for (const json& row : table("table 6").at("rows")) {
    if (row.at(1).is_null()) continue;  // the paper's
    ++rows;
    for (const std::size_t basis : {0, 1, 2}) {
      EXPECT_GT(row.at(2 + basis), 0) << row;
      EXPECT_LE(row.at(5 + basis), row.at(1)) << row;
    }
    EXPECT_LE(row.at(2), row.at(3)) << "the functions found in the data are no more than Fourier's";
  }
  EXPECT_EQ(rows, 6) << "whole clips and sequences, at 5, 2 and 1 %";
  EXPECT_EQ(report_.at("results").size(), 6U);
}

TEST_F(Yoo2019, figures_have_titles_axes_and_a_legend) {
  const std::string curves = read_text(pictures() / "yoo2019-figure-8-clips.svg");
  for (const char* word :
       {"figure 8", "time (s)", "quaternion component", "original", "Our method", "Fourier", "Legendre"}) {
    EXPECT_THAT(curves, HasSubstr(word));
  }
  EXPECT_THAT(read_text(pictures() / "yoo2019-figure-8-clips-errors.svg"), HasSubstr("decoded less original"));
  const std::string svg = read_text(pictures() / "yoo2019-figure-9-clips.svg");
  for (const char* word : {"figure 9", "number of basis functions", "compression factor", "ours", "paper: Fourier"})
    EXPECT_THAT(svg, HasSubstr(word));
}

TEST(Yoo2019Input, clips_that_are_not_there_are_named) {
  const TemporaryFolder folder;
  const CommandResult result = run_command({"bench", "yoo2019", "--clips", (folder / "nowhere").string()});
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.err, HasSubstr("nowhere"));
  EXPECT_EQ(result.out, "");
}

}  // namespace
}  // namespace kinespace::test
