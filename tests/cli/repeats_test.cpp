// info --repeats as a user runs it, on sample clips.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "examples/sample_motions.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using nlohmann::json;

class RepeatsCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    write_clip(*folder_ / "slow.bvh", make_walk({.speed_m_s = 1, .duration_s = 6}).clip);
    write_clip(*folder_ / "fast.bvh", make_walk({.speed_m_s = 1.5, .duration_s = 6}).clip);
    write_clip(*folder_ / "other_rate.bvh", make_walk({.take = {.rate_hz = 30}}).clip);
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string at(const char* name) { return (*folder_ / name).string(); }

  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<TemporaryFolder> RepeatsCommand::folder_;

TEST_F(RepeatsCommand, a_walk_repeats_itself) {
  const CommandResult result = run_command({"info", at("slow.bvh"), at("fast.bvh"), "--repeats", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(result.out);
  EXPECT_EQ(report["kind"], "repeats");
  EXPECT_EQ(report["clips"], 2);
  EXPECT_GT(report["share_repeated"], 0.5);
  ASSERT_FALSE(report["primaries"].empty());
  for (const json& primary : report["primaries"]) {
    EXPECT_LT(primary["start_s"], primary["end_s"]);
    ASSERT_FALSE(primary["repetitions"].empty());
    for (const json& repetition : primary["repetitions"]) {
      EXPECT_TRUE(repetition["clip"] == "slow" || repetition["clip"] == "fast");
      EXPECT_GE(repetition["start_s"], 0);
      EXPECT_LE(repetition["end_s"], 6.1);
    }
  }
}

TEST_F(RepeatsCommand, a_folder_stands_for_the_clips_in_it) {
  const TemporaryFolder walks;
  write_clip(walks / "a.bvh", make_walk({.duration_s = 4}).clip);
  write_clip(walks / "b.bvh", make_walk({.speed_m_s = 1.2, .duration_s = 4}).clip);
  const CommandResult result = run_command({"info", walks.path().string(), "--repeats", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(json::parse(result.out)["clips"], 2);
}

TEST_F(RepeatsCommand, the_picture_is_an_svg_with_the_table_in_it) {
  const CommandResult result = run_command({"info", at("slow.bvh"), "--repeats", "--picture", at("p.svg")});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("again"), std::string::npos);
  std::ifstream file(at("p.svg"));
  const std::string svg{std::istreambuf_iterator<char>(file), {}};
  EXPECT_TRUE(svg.starts_with("<svg"));
  EXPECT_NE(svg.find("data:image/png;base64,iVBORw0KGgo"), std::string::npos);
}

TEST_F(RepeatsCommand, clips_of_two_rates_several_files_without_repeats_and_pictures_over_their_clip_are_errors) {
  const CommandResult rates = run_command({"info", at("slow.bvh"), at("other_rate.bvh"), "--repeats"});
  EXPECT_EQ(rates.code, 1);
  EXPECT_NE(rates.err.find("other_rate.bvh"), std::string::npos);
  EXPECT_EQ(run_command({"info", at("slow.bvh"), at("fast.bvh")}).code, 2);
  EXPECT_EQ(run_command({"info", at("slow.bvh"), "--clip", "slow"}).code, 2) << "of a picture that is not asked for";
  EXPECT_EQ(run_command({"info", at("slow.bvh"), "--picture", at("slow.bvh")}).code, 2);
  EXPECT_EQ(run_command({"info", at("slow.bvh"), "--repeats", "--picture", at("slow.bvh")}).code, 2);
}

}  // namespace
}  // namespace kinespace::test
