// clean, contacts and the skate figures of compare, as a user runs them.
#include <filesystem>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "examples/sample_motions.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using nlohmann::json;

// A walk whose root path is 1.15 times as long as its steps, and the walk as it was.
class FeetCommands : public ::testing::Test {
 protected:
  FeetCommands() {
    Clip walk = make_walk({.duration_s = 3}).clip;
    write_clip(folder_ / "walk.bvh", walk);
    for (Eigen::Vector3d& p : walk.require_translation_track(0).values) p.z() *= 1.15;
    write_clip(folder_ / "skating.bvh", walk);
  }
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  TemporaryFolder folder_;
};

TEST_F(FeetCommands, clean_takes_skate_out_and_prints_its_keys) {
  const CommandResult result =
      run_command({"clean", path("skating.bvh"), "-o", path("clean.bvh"), "--picture", path("clean.svg"), "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(result.out);
  EXPECT_GT(report["foot_slide_before_cm_s"], 10);
  EXPECT_LT(report["foot_slide_after_cm_s"], 1);
  EXPECT_GT(report["plants"], 4);
  for (const char* key : {"output", "frames", "floor_penetration_cm", "mean_pose_change_cm", "acceleration_ratio",
                          "ground", "floor_cm", "left_ankle", "right_ankle"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
  EXPECT_LT(report["feet_after"]["slide_cm_s"], report["feet_before"]["slide_cm_s"]);
  EXPECT_EQ(read_clip(folder_ / "clean.bvh").frames, report["frames"]);
  EXPECT_NE(read_text(folder_ / "clean.svg").find("<svg"), std::string::npos);
}

// A clip in which no foot stands: nothing can be said, so --strict does not take it for good.
TEST_F(FeetCommands, clean_that_is_strict_writes_nothing_that_it_doubts) {
  const SampleMotion walk = make_walk({.duration_s = 2});
  Clip flying = walk.clip;
  auto& track = flying.require_translation_track(flying.skeleton.travel_root()).values;
  for (std::size_t f = 0; f < track.size(); ++f) track[f].y() += 3.0 * static_cast<double>(f);
  write_clip(folder_ / "flying.bvh", flying);
  EXPECT_EQ(run_command({"clean", path("flying.bvh"), "-o", path("plain.bvh")}).code, 0);
  const CommandResult strict = run_command({"clean", path("flying.bvh"), "-o", path("strict.bvh"), "--strict"});
  EXPECT_EQ(strict.code, 1);
  EXPECT_NE(strict.err.find("--strict"), std::string::npos) << strict.err;
  EXPECT_FALSE(std::filesystem::exists(path("strict.bvh")));
}

TEST_F(FeetCommands, clean_takes_named_feet_and_refuses_names_that_are_not_there) {
  const std::string in = path("skating.bvh");
  EXPECT_EQ(run_command({"clean", in, "-o", path("a.bvh"), "--feet", "LeftFoot,RightFoot", "--floor", "0"}).code, 0);
  const CommandResult wrong = run_command({"clean", in, "-o", path("b.bvh"), "--feet", "LeftFoot,Paw"});
  EXPECT_EQ(wrong.code, 1);
  EXPECT_NE(wrong.err.find("Paw"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path("b.bvh")));
  EXPECT_EQ(run_command({"clean", in, "-o", path("b.bvh"), "--feet", "LeftFoot"}).code, 2);
  EXPECT_EQ(run_command({"clean", in, "-o", in}).code, 2);
}

TEST_F(FeetCommands, clean_of_a_clip_without_feet_says_how_to_name_them) {
  write_text(folder_ / "snake.bvh", walking_bvh(20, 1));
  const CommandResult result = run_command({"clean", path("snake.bvh"), "-o", path("out.bvh")});
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("--feet LEFT,RIGHT"), std::string::npos) << result.err;
}

TEST_F(FeetCommands, compare_tells_the_slide_and_null_without_feet) {
  const json skating = json::parse(run_command({"compare", path("walk.bvh"), path("skating.bvh"), "--json"}).out);
  EXPECT_GT(skating["foot_slide_cm_s"], 10);
  EXPECT_LT(skating["floor_penetration_cm"], 0.1);
  write_text(folder_ / "snake.bvh", walking_bvh(20, 1));
  const json snake = json::parse(run_command({"compare", path("snake.bvh"), path("snake.bvh"), "--json"}).out);
  EXPECT_TRUE(snake["foot_slide_cm_s"].is_null());
  EXPECT_TRUE(snake["floor_penetration_cm"].is_null());
  EXPECT_GT(skating["feet_of_b"]["slide_cm_s"].get<double>(), 2 * skating["feet_of_a"]["slide_cm_s"].get<double>());
  for (const char* key : {"slide_cm_s", "lowest_speed_cm_s", "penetration_cm", "hover_cm"}) {
    EXPECT_TRUE(snake["feet_of_a"][key].is_null()) << key;
  }
}

TEST_F(FeetCommands, contacts_go_round_as_labels_of_a_library) {
  const std::string library = path("a.kspace");
  ASSERT_EQ(run_command({"build", path("walk.bvh"), path("skating.bvh"), "-o", library}).code, 0);
  const CommandResult without = run_command({"clean", path("skating.bvh"), "-o", path("c.bvh"), "--library", library});
  EXPECT_EQ(without.code, 0);
  EXPECT_NE(without.err.find("no contact labels"), std::string::npos);

  const json next = json::parse(run_command({"contacts", "--library", library, "--next", "--json"}).out);
  const std::string clip = next["clip"];
  ASSERT_FALSE(next["contacts"].empty());
  write_text(folder_ / "labels.txt", run_command({"contacts", "--library", library, "--next"}).out);
  const CommandResult labelled =
      run_command({"contacts", "--library", library, "--label", clip, "--from", path("labels.txt"), "--json"});
  ASSERT_EQ(labelled.code, 0) << labelled.err;
  EXPECT_EQ(json::parse(labelled.out)["contacts"], next["contacts"].size());
  EXPECT_EQ(json::parse(labelled.out)["labelled_clips"], 1);
  const json after = json::parse(run_command({"contacts", "--library", library, "--next", "--json"}).out);
  EXPECT_NE(after["clip"], clip);

  write_text(folder_ / "wrong.txt", "LeftFoot 3\n");
  const CommandResult wrong =
      run_command({"contacts", "--library", library, "--label", clip, "--from", path("wrong.txt")});
  EXPECT_EQ(wrong.code, 1);
  EXPECT_NE(wrong.err.find("wrong.txt:1"), std::string::npos) << wrong.err;
  EXPECT_EQ(run_command({"contacts", "--next"}).code, 2);
  EXPECT_EQ(run_command({"contacts"}).code, 2);
}

}  // namespace
}  // namespace kinespace::test
