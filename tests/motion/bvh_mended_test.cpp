// BVH files as they are in the world: what is wrong with them is mended, and said.
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/file.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"
#include "tests/motion/sample_clips.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

struct Mended {
  Clip clip;
  std::vector<std::string> notes;
  std::vector<std::pair<int, int>> lost;
};

Mended mended(std::string_view text, ClipReadOptions options = {}) {
  Mended out;
  options.note = [&](const std::string& what) { out.notes.push_back(what); };
  options.lost = [&](int first, int last) { out.lost.emplace_back(first, last); };
  out.clip = parse_bvh(text, "it.bvh", options);
  EXPECT_EQ(what_is_wrong_with(out.clip), "");
  return out;
}

TEST(MendedBvh, the_lines_decide_how_many_frames_there_are) {
  const Clip want = parse_bvh(small_bvh, "it.bvh");
  for (const char* said : {"1", "2", "0", "4", "2147483647"}) {
    SCOPED_TRACE(said);
    const Mended got = mended(replaced(small_bvh, "Frames: 3", std::string("Frames: ") + said));
    ASSERT_EQ(got.clip.frames, 3);
    EXPECT_EQ(got.clip.rotations, want.rotations);
    ASSERT_EQ(got.clip.translations.size(), want.translations.size());
    EXPECT_EQ(got.clip.translations[0].values, want.translations[0].values);
    EXPECT_THAT(got.notes, ElementsAre(HasSubstr(std::string("3 whole frames of data, not ") + said)));
  }
}

TEST(MendedBvh, many_more_frames_than_said_are_all_read) {
  const Clip clip = random_clip(1, 3000);
  const std::string text = format_bvh(clip);
  const Mended got = mended(replaced(text, "Frames: 3000", "Frames: 7"));
  ASSERT_EQ(got.clip.frames, 3000);
  EXPECT_EQ(got.clip.rotations, parse_bvh(text, "it.bvh").rotations);
}

TEST(MendedBvh, a_last_line_that_is_cut_is_left_out) {
  for (const char* rest : {"2 92 -1 90 0", "2 92 -1 90 0 0 .5 -2.E+0 -", "2 92 -1 90 0\n\n"}) {
    const Mended got = mended(with_line(small_bvh, 35, "").substr(0, small_bvh.find("\n2 92") + 1) + rest);
    EXPECT_EQ(got.clip.frames, 2) << rest;
    EXPECT_THAT(got.notes, ElementsAre(HasSubstr("cut short"), HasSubstr("2 whole frames"))) << rest;
  }
}

TEST(MendedBvh, no_frames_are_the_rest_pose) {
  const std::string header(small_bvh.substr(0, small_bvh.find("0 90 0 0 0 0 10")));
  const Mended got = mended(replaced(header, "Frames: 3", "Frames: 0"));
  EXPECT_EQ(got.clip.frames, 1);
  EXPECT_EQ(joint_positions(got.clip).at(0, 0), Eigen::Vector3d(0, 90, 0));
  EXPECT_THAT(got.notes, ElementsAre(HasSubstr("rest pose")));
}

TEST(MendedBvh, lines_with_nan_are_lost_frames) {
  const Clip clip = random_clip(2, 700);
  std::string text = format_bvh(clip);
  const auto lose = [&](int frame, const char* with) {
    const std::size_t at = text.find("Frame Time");
    std::size_t line = text.find('\n', at) + 1;
    for (int f = 0; f < frame; ++f) line = text.find('\n', line) + 1;
    text.replace(line, text.find(' ', line) - line, with);
  };
  for (int frame = 0; frame < 3; ++frame) lose(frame, "nan");
  lose(100, "-NaN");
  for (int frame = 300; frame < 600; ++frame) lose(frame, "-1.#IND");
  lose(699, "nan");
  const Mended got = mended(text);
  EXPECT_THAT(got.lost, ElementsAre(Pair(0, 2), Pair(100, 100), Pair(300, 599), Pair(699, 699)));
  EXPECT_THAT(got.notes, ElementsAre(HasSubstr("305 lost frames (nan) in 4 gaps")));
  const Clip whole = parse_bvh(format_bvh(clip), "it.bvh");
  for (int f = 0; f < 700; ++f) {
    const int stands = f < 3 ? 3 : f == 100 ? 99 : f >= 300 && f < 600 ? 299 : f == 699 ? 698 : f;
    for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
      ASSERT_LT(got.clip.rotation(j, f).angularDistance(whole.rotation(j, stands)), 1e-7) << f << " " << j;
      ASSERT_EQ(got.clip.translation(j, f), whole.translation(j, stands)) << f << " " << j;
    }
  }
}

TEST(MendedBvh, several_roots_are_clips_each) {
  const std::string one(small_bvh);
  const std::string tree = one.substr(one.find("ROOT"), one.find("MOTION") - one.find("ROOT"));
  std::string both = replaced(one, "MOTION", replaced(tree, "Hips", "Other") + "MOTION");
  for (const char* row :
       {"0 90 0 0 0 0 10 20 30 5", "1 91 0.5 0 0 90 -10 20.25 1e1 -5.5", "2 92 -1 90 0 0 .5 -2.E+0 -170 7"}) {
    both = replaced(both, row, std::string(row) + " 5 6 7 0 0 0 1 2 3 4");
  }
  const TemporaryFolder folder;
  write_file_atomically(folder / "two.bvh", both);
  const std::vector<Clip> clips = read_clips(folder / "two.bvh");
  ASSERT_EQ(clips.size(), 2u);
  EXPECT_EQ(clips[0].name, "two.1");
  EXPECT_EQ(clips[1].name, "two.2");
  EXPECT_EQ(clips[0].rotations, parse_bvh(small_bvh, "it.bvh").rotations);
  EXPECT_EQ(clips[1].skeleton.joints[0].name, "Other");
  EXPECT_EQ(clips[1].skeleton.joints[1].parent, 0);
  EXPECT_EQ(joint_positions(clips[1]).at(1, 0), Eigen::Vector3d(5, 6, 7));
  EXPECT_THAT(clips_of_file(folder / "two.bvh"), ElementsAre("1", "2"));
  for (const char* chosen : {"2", "Other"}) {
    EXPECT_EQ(read_clip(folder / "two.bvh", {.animation = chosen}).name, "two.2");
  }
  EXPECT_THAT(error_of([&] { static_cast<void>(read_clip(folder / "two.bvh", {.animation = "3"})); }).expected,
              HasSubstr("1 to 2"));
}

TEST(MendedBvh, an_end_site_with_channels_is_a_joint) {
  const Mended none = mended(replaced(small_bvh, "OFFSET 0 0 15", "OFFSET 0 0 15 CHANNELS 0"));
  EXPECT_EQ(none.clip.skeleton.joint_count(), 4);
  EXPECT_EQ(*none.clip.skeleton.joints[2].end_site, Eigen::Vector3d(0, 0, 15));
  std::string text = replaced(small_bvh, "OFFSET 0 0 15", "OFFSET 0 0 15 CHANNELS 1 Xrotation");
  for (const char* row : {"20 30 5\n", "1e1 -5.5\n", "-170 7\n"}) {
    text = replaced(text, row, std::string(row).substr(0, std::string(row).size() - 1) + " 11\n");
  }
  const Clip clip = mended(text).clip;
  ASSERT_EQ(clip.skeleton.joint_count(), 5);
  EXPECT_EQ(clip.skeleton.joints[3].name, "Foot end");
  EXPECT_EQ(clip.skeleton.joints[3].offset, Eigen::Vector3d(0, 0, 15));
  EXPECT_FALSE(clip.skeleton.joints[2].end_site);
}

TEST(MendedBvh, frame_times_that_are_rates_or_rounded) {
  const auto rate = [](const char* time, const ClipReadOptions& options = {}) {
    return mended(replaced(small_bvh, "0.0333333", time), options);
  };
  for (const auto& [time, hz] :
       {std::pair{"30", 30.0}, {"120", 120.0}, {"0.033", 30.0}, {"0.042", 24.0}, {"0.0083", 120.0}}) {
    EXPECT_EQ(rate(time).clip.rate_hz, hz) << time;
    EXPECT_THAT(rate(time).notes, ElementsAre(HasSubstr("is taken for"))) << time;
  }
  for (const auto& [time, hz] : {std::pair{"0.0333333", 30.0}, {"0.02", 50.0}, {"1", 1.0}, {"0.0100", 100.0}}) {
    EXPECT_EQ(rate(time).clip.rate_hz, hz) << time;
    EXPECT_THAT(rate(time).notes, IsEmpty()) << time;
  }
  EXPECT_NEAR(rate("0.0333667").clip.rate_hz, 29.97, 1e-3);
  EXPECT_EQ(rate("0", {.rate_hz = 60}).clip.rate_hz, 60);
  EXPECT_EQ(rate("0.0333333", {.rate_hz = 60}).clip.rate_hz, 60);
}

}  // namespace
}  // namespace kinespace::test
