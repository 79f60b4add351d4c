#include "kinespace/library/library_builder.h"

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/library/library_view.h"
#include "kinespace/motion/error_measures.h"
#include "tests/support/library_folder.h"

namespace kinespace {
namespace {

TEST(LibraryBuilder, a_folder_becomes_a_library_whose_clips_play) {
  const test::LibraryFolder folder;
  const LibraryReport report = folder.build();
  EXPECT_EQ(report.clips, folder.count());
  EXPECT_LT(report.mean_joint_error_cm, 0.1);
  LibraryView view(folder.library());
  for (const ClipRow& row : view.library().clips()) {
    const Clip original = read_clip(row.source);
    const MotionError error = compare(original, view.clip(row));
    EXPECT_LT(error.mean_joint_error_cm, 0.15) << row.name;
    EXPECT_GT(compare(original, view.clip(row, 2)).mean_joint_error_cm, error.mean_joint_error_cm);
  }
}

TEST(LibraryBuilder, a_stopped_build_goes_on_where_it_was) {
  const test::LibraryFolder folder;
  int asked = 0;
  Progress progress;
  progress.stop_requested = [&asked] { return ++asked > 3; };
  EXPECT_THROW(
      static_cast<void>(build_library(find_motion_files({folder.clips()}), folder.library(), {}, {}, progress)),
      Interrupted);
  EXPECT_FALSE(std::filesystem::exists(folder.library()));
  const LibraryReport report = folder.build();
  EXPECT_GT(report.resumed, 0);
  EXPECT_EQ(report.clips, folder.count());
}

TEST(LibraryBuilder, clips_are_added_without_starting_over) {
  const test::LibraryFolder folder;
  auto files = find_motion_files({folder.clips()});
  const std::vector<std::filesystem::path> half(files.begin(),
                                                files.begin() + static_cast<std::ptrdiff_t>(files.size() / 2));
  static_cast<void>(build_library(half, folder.library(), {}));
  const LibraryReport report = folder.build({.add = true});
  EXPECT_EQ(report.unchanged, static_cast<int>(half.size()));
  EXPECT_EQ(report.clips, folder.count());
  LibraryView view(folder.library());
  for (const ClipRow& row : view.library().clips()) {
    EXPECT_LT(compare(read_clip(row.source), view.clip(row)).mean_joint_error_cm, 0.3) << row.name;
  }
}

TEST(LibraryBuilder, two_joint_trees_need_to_be_asked_for) {
  const test::LibraryFolder folder;
  Clip other = make_clip("stranger", sample_skeleton(), 30, 40);
  other.skeleton.joints.back().name = "other";
  write_clip(folder.clips() / "stranger.bvh", other);
  try {
    static_cast<void>(folder.build());
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_NE(std::string(error.what()).find("--by-skeleton"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("stranger.bvh"), std::string::npos);
  }
  EXPECT_EQ(folder.build({.by_skeleton = true}).spaces, 2);
}

TEST(LibraryBuilder, equal_file_names_are_told_apart_by_their_folders) {
  EXPECT_EQ(clip_names({"a/x/walk.bvh", "b/x/walk.bvh", "a/run.bvh"}),
            (std::vector<std::string>{"a/x/walk", "b/x/walk", "run"}));
}

TEST(LibraryBuilder, labels_are_the_parts_of_the_name_that_are_no_numbers) {
  EXPECT_EQ(labels_of("set/walk_happy_012"), (std::vector<std::string>{"walk", "happy"}));
}

TEST(LibraryBuilder, what_is_not_there_is_named) {
  EXPECT_THROW(static_cast<void>(find_motion_files({"/nowhere/at all"})), Error);
  const test::TemporaryFolder empty;
  EXPECT_THROW(static_cast<void>(find_motion_files({empty.path()})), Error);
}

}  // namespace
}  // namespace kinespace
