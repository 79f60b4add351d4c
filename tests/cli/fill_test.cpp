// fill as a user runs it: a hole that a recorder left, the keys, and what it refuses.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/library_folder.h"

namespace kinespace::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class FillCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<LibraryFolder>();
    (void)folder_->build();
  }
  static void TearDownTestSuite() { folder_.reset(); }

  // A walk the library has not, its frames 100 to 130 held as frame 99.
  FillCommand() {
    truth_ = make_walk({.speed_m_s = 1.25, .start_phase = 0.3, .duration_s = 4, .take = {.seed = 77}}).clip;
    Clip held = truth_;
    for (int f = 100; f <= 130; ++f) {
      for (int j = 0; j < held.skeleton.joint_count(); ++j) held.set_rotation(j, f, held.rotation(j, 99));
      for (auto& track : held.translations) track.values[static_cast<std::size_t>(f)] = track.values[99];
    }
    write_clip(in(), held);
  }
  [[nodiscard]] std::string in() const { return own_ / "in.bvh"; }
  [[nodiscard]] std::string out() const { return own_ / "out.bvh"; }
  [[nodiscard]] CommandResult fill(std::vector<std::string> more) const {
    std::vector<std::string> all = {"fill", in(), "-o", out(), "--library", folder_->library().string()};
    all.insert(all.end(), more.begin(), more.end());
    return run_command(all);
  }

  static std::unique_ptr<LibraryFolder> folder_;
  TemporaryFolder own_;
  Clip truth_;
};
std::unique_ptr<LibraryFolder> FillCommand::folder_;

TEST_F(FillCommand, finds_and_fills_the_frames_a_recorder_held) {
  const std::string picture = own_ / "gap.svg";
  const CommandResult result = fill({"--json", "--picture", picture});
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(result.out);
  EXPECT_EQ(report["found"], true);
  ASSERT_EQ(report["gaps"].size(), 1U);
  EXPECT_EQ(report["gaps"][0]["first_frame"], 100);
  EXPECT_EQ(report["gaps"][0]["last_frame"], 130);
  for (const char* key : {"from_s", "to_s", "windows", "mean_std_cm", "max_std_cm"}) {
    EXPECT_TRUE(report["gaps"][0][key].is_number()) << key;
  }
  const double before = compare(truth_, read_clip(in())).mean_joint_error_cm;
  EXPECT_LT(compare(truth_, read_clip(out())).mean_joint_error_cm, 0.3 * before);
  EXPECT_GT(std::filesystem::file_size(picture), 1000U);
}

TEST_F(FillCommand, fills_the_times_it_is_given) {
  const CommandResult result = fill({"--json", "--from", "1.0", "--to", "1.5"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(result.out);
  EXPECT_EQ(report["found"], false);
  EXPECT_EQ(report["gaps"][0]["first_frame"], 60);
  EXPECT_EQ(report["gaps"][0]["last_frame"], 90);
}

TEST_F(FillCommand, refuses_bad_gaps_and_writes_nothing) {
  const auto expect = [&](std::vector<std::string> more, int code, const char* words) {
    const CommandResult result = fill(std::move(more));
    EXPECT_EQ(result.code, code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(out()));
  };
  expect({"--from", "1"}, 2, "--from and --to");
  expect({"--from", "2", "--to", "1"}, 2, "times in order");
  expect({"--from", "3", "--to", "9"}, 2, "from 0 to");
  expect({"--from", "0", "--to", "1"}, 1, "seen frames before the gap");
  expect({"--from", "0.5", "--to", "3.5", "--max-gap", "1"}, 1, "at most 1 s");
  expect({"--max-gap", "-1"}, 2, "--max-gap");
  write_clip(in(), truth_);
  expect({}, 1, "no missing frames");
}

}  // namespace
}  // namespace kinespace::test
