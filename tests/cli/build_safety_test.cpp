// What a build must not do: mix skeletons unasked, overwrite its input, lose the old library.
#include <algorithm>
#include <csignal>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/motion/read.h"
#include "kinespace/storage/detail/sqlite.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class BuildSafety : public testing::Test {
 protected:
  void add_samples(int takes) const {
    for (const SampleMotion& motion : sample_library({.takes = takes})) {
      write_clip(folder_.path() / (motion.clip.name + ".bvh"), motion.clip);
    }
  }
  std::string clips() const { return folder_.path().string(); }
  std::string library() const { return (libraries_ / "out.kspace").string(); }

  TemporaryFolder folder_;
  TemporaryFolder libraries_;
};

TEST_F(BuildSafety, two_joint_trees_in_one_build_name_both_files_and_the_way_out) {
  add_samples(1);
  write_text(folder_ / "other.bvh", walking_bvh(200, 1));
  const CommandResult mixed = run_command({"build", clips(), "-o", library()});
  EXPECT_EQ(mixed.code, 1);
  EXPECT_EQ(std::count(mixed.err.begin(), mixed.err.end(), '\n'), 1) << mixed.err;
  EXPECT_THAT(mixed.err, HasSubstr("other.bvh"));
  EXPECT_THAT(mixed.err, HasSubstr("_001.bvh"));
  EXPECT_THAT(mixed.err, HasSubstr("--by-skeleton"));
  EXPECT_FALSE(std::filesystem::exists(library()));
  const CommandResult apart = run_command({"build", clips(), "-o", library(), "--by-skeleton"});
  EXPECT_EQ(apart.code, 0) << apart.err;
}

// A clip so long that its import is kept in two parts.
TEST_F(BuildSafety, an_import_that_is_damaged_in_any_part_is_made_again) {
  const std::string clip = (folder_ / "long.bvh").string();
  write_text(clip, walking_bvh(70'000, 0.01));
  ASSERT_EQ(run_command({"build", clip, "-o", library(), "--no-align"}).code, 0);
  const std::string expected = read_text(library());
  std::filesystem::remove(library());
  write_clip(folder_ / "other.bvh", make_walk().clip);  // of another tree: the build fails, what was imported stays
  const std::string partial = library() + ".partial";
  for (const char* part : {"%", "% part 1", "%"}) {
    ASSERT_EQ(run_command({"build", clips(), "-o", library()}).code, 1);
    ASSERT_TRUE(std::filesystem::exists(partial));
    sqlite::Database database(partial, sqlite::Mode::read_write, partial);
    database.prepare("UPDATE imports SET checksum = checksum + 1 WHERE key LIKE ?").bind(1, part).run();
  }
  std::filesystem::remove(folder_ / "other.bvh");
  const CommandResult result = run_command({"build", clip, "-o", library(), "--no-align"});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(read_text(library()), expected);
}

TEST_F(BuildSafety, an_output_that_is_an_input_is_refused) {
  write_text(folder_ / "walk.bvh", walking_bvh(200, 1));
  const std::string clip = (folder_ / "walk.bvh").string();
  const std::string before = read_text(clip);
  const CommandResult result = run_command({"build", clips(), "-o", clip});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, StartsWith("kinespace: " + clip));
  EXPECT_EQ(read_text(clip), before);
}

TEST_F(BuildSafety, ctrl_c_leaves_the_old_library_and_the_next_build_goes_through) {
  add_samples(1);
  ASSERT_EQ(run_command({"build", clips(), "-o", library()}).code, 0);
  const std::string before = read_text(library());
  add_samples(8);
  Command command({"build", clips(), "-o", library(), "--quiet"});
  command.send(SIGINT);
  const CommandResult stopped = command.finish();
  EXPECT_EQ(stopped.code, 130) << stopped.err;
  EXPECT_EQ(read_text(library()), before);
  EXPECT_EQ(run_command({"build", clips(), "-o", library(), "--quiet"}).code, 0);
  EXPECT_NE(read_text(library()), before);
}

}  // namespace
}  // namespace kinespace::test
