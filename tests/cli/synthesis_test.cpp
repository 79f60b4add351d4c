// transition and blend as a user runs them, on the sample clips.
#include <filesystem>
#include <memory>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "examples/sample_motions.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/cli/sample_clips.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using nlohmann::json;

class SynthesisCommands : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    write_sample_clips(*folder_ / "clips");
    write_clip(*folder_ / "clips" / "stand_short_001.bvh", make_stand({.duration_s = 0.4}).clip);
    write_text(*folder_ / "clips" / "other_tree_001.bvh", walking_bvh(200, 1));
    built_ = run_command({"build", out("clips"), "-o", library(), "--by-skeleton"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string library() { return out("sample.kspace"); }
  static std::string out(const char* name) { return (*folder_ / name).string(); }
  void SetUp() override { ASSERT_EQ(built_.code, 0) << built_.err; }

  static std::unique_ptr<TemporaryFolder> folder_;
  static CommandResult built_;
};
std::unique_ptr<TemporaryFolder> SynthesisCommands::folder_;
CommandResult SynthesisCommands::built_;

TEST_F(SynthesisCommands, transition_writes_the_motion_its_picture_and_its_figures) {
  const auto result = run_command({"transition", library(), "walk_normal_001", "run_normal_001", "-o", out("t.glb"),
                                   "--picture", out("t.svg"), "--clean-feet", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json figures = json::parse(result.out);
  for (const char* key : {"clips", "scale", "shift_s", "cost", "seam_speed_ratio", "seam_acceleration_ratio"}) {
    EXPECT_TRUE(figures.contains(key)) << key;
  }
  EXPECT_LE(figures["seam_speed_ratio"], 2);
  EXPECT_LT(figures["foot_slide_after_cm_s"], figures["foot_slide_before_cm_s"]);
  EXPECT_TRUE(std::filesystem::exists(out("t.glb")));
  EXPECT_NE(read_text(out("t.svg")).find("</svg>"), std::string::npos);
}

TEST_F(SynthesisCommands, a_transition_tells_the_feet_by_geometry_and_plants_them_unless_told_not_to) {
  const std::vector<std::string> call{"transition", library(),    "walk_normal_001", "run_normal_001",
                                      "-o",         out("f.bvh"), "--json"};
  const auto planned = run_command(call);
  auto plain_call = call;
  plain_call.push_back("--no-clean-feet");
  const auto plain = run_command(plain_call);
  ASSERT_EQ(planned.code + plain.code, 0) << planned.err << plain.err;
  const json with = json::parse(planned.out)["seams"][0], without = json::parse(plain.out)["seams"][0];
  EXPECT_TRUE(with["feet_planned"]);
  EXPECT_FALSE(without["feet_planned"]);
  EXPECT_LT(with["feet"]["slide_cm_s"], without["feet"]["slide_cm_s"]);
  EXPECT_LT(with["feet"]["slide_cm_s"].get<double>(), 1.3 * with["feet_of_clips"]["slide_cm_s"].get<double>());
  EXPECT_TRUE(with["way"] == "blend" || with["way"] == "inertialization");
  EXPECT_GE(with["scale"].get<double>(), 0.8 - 1e-6);
}

TEST_F(SynthesisCommands, the_way_through_the_graph_is_kept_in_the_library) {
  const auto before = std::filesystem::file_size(library());
  const auto result = run_command(
      {"transition", library(), "stand_calm_001", "run_fast_001", "--via-graph", "-o", out("far.bvh"), "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json figures = json::parse(result.out);
  EXPECT_EQ(figures["clips"].front(), "stand_calm_001");
  EXPECT_EQ(figures["clips"].back(), "run_fast_001");
  EXPECT_GT(std::filesystem::file_size(library()), before);
}

TEST_F(SynthesisCommands, no_way_is_an_answer_and_writes_nothing) {
  const auto result = run_command({"transition", library(), "stand_calm_001", "run_fast_001", "--via-graph",
                                   "--max-cost", "0.001", "-o", out("none.bvh"), "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_FALSE(json::parse(result.out)["found"]);
  EXPECT_FALSE(std::filesystem::exists(out("none.bvh")));
}

TEST_F(SynthesisCommands, blend_at_a_clip_is_that_clip) {
  ASSERT_EQ(run_command({"export", library(), "walk_fast_001", "-o", out("wanted.bvh")}).code, 0);
  const auto result = run_command(
      {"blend", library(), "walk_slow_001", "walk_fast_001", "--at", "1", "-o", out("blend.bvh"), "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const auto compared = run_command({"compare", out("wanted.bvh"), out("blend.bvh"), "--json"});
  EXPECT_LT(json::parse(compared.out)["max_joint_error_cm"], 1e-3);
}

TEST_F(SynthesisCommands, what_cannot_be_joined_is_told_in_one_line) {
  const auto fails = [&](const std::vector<std::string>& clips, int code, const char* words) {
    std::vector<std::string> arguments{"transition", library()};
    arguments.insert(arguments.end(), clips.begin(), clips.end());
    arguments.insert(arguments.end(), {"-o", out("bad.bvh")});
    const auto result = run_command(arguments);
    EXPECT_EQ(result.code, code) << result.err;
    EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(out("bad.bvh")));
  };
  fails({"walk_normal_001", "other_tree_001"}, 1, "different skeletons");
  fails({"walk_normal_001", "stand_short_001"}, 1, "twice the smallest overlap");
  fails({"walk_normal_001", "nothing"}, 2, "nearest name");
  fails({"walk_normal_001"}, 2, "two clips or more");
}

TEST_F(SynthesisCommands, the_library_is_never_the_output) {
  const auto result = run_command({"blend", library(), "walk_slow_001", "walk_fast_001", "-o", library()});
  EXPECT_NE(result.code, 0);
  EXPECT_EQ(run_command({"info", library()}).code, 0);
}

}  // namespace
}  // namespace kinespace::test
