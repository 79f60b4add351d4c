#include "kinespace/motion/bvh.h"

#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/text.h"
#include "tests/motion/sample_clips.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using testing::HasSubstr;

Eigen::Quaterniond turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis));
}
const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();

// A root with the given channels and one frame of their numbers.
std::string one_joint(const std::string& channels, const std::string& numbers) {
  return "HIERARCHY\nROOT r\n{\nOFFSET 1 2 3\nCHANNELS " + channels +
         "\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.01\n" + numbers + "\n";
}

TEST(Bvh, reads_the_tree_with_its_names_offsets_channels_and_end_sites) {
  const Clip clip = parse_bvh(small_bvh, "folder/walk 1.bvh");
  EXPECT_EQ(clip.name, "walk 1");
  ASSERT_EQ(clip.skeleton.joint_count(), 4);
  const auto& joints = clip.skeleton.joints;
  EXPECT_EQ(joints[1].name, "Left Leg");
  EXPECT_EQ(joints[1].parent, 0);
  EXPECT_EQ(joints[2].parent, 1);
  EXPECT_EQ(joints[3].parent, 0);
  EXPECT_EQ(joints[1].offset, Eigen::Vector3d(10, -5, 0));
  EXPECT_EQ(joints[2].channels, std::vector<Channel>{Channel::x_rotation});
  EXPECT_TRUE(joints[3].channels.empty());
  EXPECT_EQ(joints[2].end_site, Eigen::Vector3d(0, 0, 15));
  EXPECT_FALSE(joints[0].end_site || joints[1].end_site);
  EXPECT_EQ(clip.frames, 3);
  EXPECT_EQ(clip.rate_hz, 30);
}

TEST(Bvh, applies_channels_from_left_to_right_per_joint) {
  const Clip clip = parse_bvh(small_bvh, "t.bvh");
  const Eigen::Quaterniond leg = turn(10, z) * turn(20, x) * turn(30, y);
  EXPECT_LT(clip.rotation(1, 0).angularDistance(leg), 1e-15);
  const Eigen::Vector3d foot =
      Eigen::Vector3d(0, 90, 0) + Eigen::Vector3d(10, -5, 0) + leg * Eigen::Vector3d(0, -40, 0);
  EXPECT_LT((joint_positions(clip).at(0, 2) - foot).norm(), 1e-12);
  EXPECT_LT(clip.rotation(0, 2).angularDistance(turn(90, z)), 1e-15);
}

TEST(Bvh, keeps_rotation_order_per_joint) {
  const struct {
    const char* channels;
    Eigen::Quaterniond rotation;
  } cases[] = {{"3 Xrotation Yrotation Zrotation", turn(10, x) * turn(20, y) * turn(30, z)},
               {"3 Xrotation Zrotation Yrotation", turn(10, x) * turn(20, z) * turn(30, y)},
               {"3 Yrotation Xrotation Zrotation", turn(10, y) * turn(20, x) * turn(30, z)},
               {"3 Yrotation Zrotation Xrotation", turn(10, y) * turn(20, z) * turn(30, x)},
               {"3 Zrotation Xrotation Yrotation", turn(10, z) * turn(20, x) * turn(30, y)},
               {"3 Zrotation Yrotation Xrotation", turn(10, z) * turn(20, y) * turn(30, x)}};
  for (const auto& c : cases) {
    const Clip clip = parse_bvh(one_joint(c.channels, "10 20 30"), "t.bvh");
    EXPECT_LT(clip.rotation(0, 0).angularDistance(c.rotation), 1e-15) << c.channels;
    const Clip again = parse_bvh(format_bvh(clip), "t.bvh");
    EXPECT_EQ(again.skeleton.joints[0].channels, clip.skeleton.joints[0].channels);
    EXPECT_LT(again.rotation(0, 0).angularDistance(c.rotation), 1e-8);
  }
}

TEST(Bvh, takes_channels_in_any_order_and_number) {
  const Clip mixed =
      parse_bvh(one_joint("6 Yrotation Zposition Xrotation Xposition Zrotation Yposition", "10 3 20 1 30 2"), "t.bvh");
  EXPECT_EQ(mixed.translation(0, 0), Eigen::Vector3d(1, 2, 3));
  EXPECT_LT(mixed.rotation(0, 0).angularDistance(turn(10, y) * turn(20, x) * turn(30, z)), 1e-15);
  const Clip two = parse_bvh(one_joint("2 Zrotation Yrotation", "10 20"), "t.bvh");
  EXPECT_LT(two.rotation(0, 0).angularDistance(turn(10, z) * turn(20, y)), 1e-15);
  EXPECT_EQ(two.translation(0, 0), Eigen::Vector3d(1, 2, 3)) << "without position channels the offset stays";
  const Clip one = parse_bvh(one_joint("1 yROTATION", "-45"), "t.bvh");
  EXPECT_LT(one.rotation(0, 0).angularDistance(turn(-45, y)), 1e-15);
}

TEST(Bvh, position_channels_replace_the_offset_as_a_whole) {
  const Clip clip = parse_bvh(one_joint("2 Yposition Xrotation", "7 0"), "t.bvh");
  EXPECT_EQ(clip.translation(0, 0), Eigen::Vector3d(0, 7, 0));
}

TEST(Bvh, keeps_translations_that_vary_as_tracks_and_folds_constant_ones_into_the_offset) {
  std::string text = replaced(small_bvh, "CHANNELS 1 Xrotation", "CHANNELS 4 Xposition Yposition Zposition Xrotation");
  text = replaced(text, "CHANNELS 0", "CHANNELS 3 Xposition Yposition Zposition");
  text = text.substr(0, text.find("0 90 0 0")) +
         "0 90 0 0 0 0 10 20 30 1 2 3 5 4 5 6\n"
         "1 91 0 0 0 0 10 20 30 1 2 3 5 4 5 6\n"
         "2 92 0 0 0 0 10 20 30 1 2 3 5 4 5 7\n";
  const Clip clip = parse_bvh(text, "t.bvh");
  ASSERT_EQ(clip.translations.size(), 2u);
  EXPECT_EQ(clip.translations[0].joint, 0);
  EXPECT_EQ(clip.translations[1].joint, 3);
  EXPECT_EQ(clip.translation(3, 1), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(clip.translation(3, 2), Eigen::Vector3d(4, 5, 7));
  EXPECT_EQ(clip.skeleton.joints[2].offset, Eigen::Vector3d(1, 2, 3)) << "constant, and not the file's OFFSET";
  EXPECT_EQ(clip.skeleton.joints[3].offset, Eigen::Vector3d(0, 60, 0)) << "the rest pose of a joint that moves";
  EXPECT_LT(largest_distance(clip, parse_bvh(format_bvh(clip), "t.bvh")), 1e-6);
}

TEST(Bvh, white_space_line_ends_and_letter_case_do_not_matter) {
  const Clip plain = parse_bvh(small_bvh, "t.bvh");
  const auto expect_same = [&](const std::string& text, const char* what) {
    const Clip other = parse_bvh(text, "t.bvh");
    EXPECT_TRUE(other.skeleton.same_tree(plain.skeleton)) << what;
    EXPECT_EQ(other.rotations, plain.rotations) << what;
    EXPECT_EQ(largest_distance(plain, other), 0) << what;
  };
  const auto each = [](std::string_view text, char from, std::string_view to) {
    std::string out;
    for (const char c : text) out += c == from ? std::string(to) : std::string(1, c);
    return out;
  };
  expect_same(each(small_bvh, '\n', "\r\n"), "CR LF");
  expect_same(each(small_bvh, '\n', "\r"), "CR");
  expect_same(each(small_bvh, ' ', "\t"), "tabs");
  expect_same(each(small_bvh, ' ', " \t  "), "more space");
  expect_same(each(small_bvh, '\n', " \n\n\t\n"), "empty lines");
  expect_same(std::string(small_bvh.substr(0, small_bvh.size() - 1)), "no newline at the end");
  expect_same("\xef\xbb\xbf" + std::string(small_bvh), "byte order mark");
  expect_same(replaced(small_bvh, "HIERARCHY\nROOT", "hierarchy root"), "lower case");
  expect_same(replaced(small_bvh, "Frames: 3", "FRAMES :\t3"), "space before a colon");
  expect_same(replaced(small_bvh, "ROOT Hips\n{\n", "ROOT Hips {"), "a brace on the name's line");
}

TEST(Bvh, names_may_hold_spaces_quotes_and_letters_of_any_language) {
  for (const char* name : {"a b  c", "it's \"quoted\"", "C:\\bone", "[1,2]", "hüfte", "caf\xe9", "JOINT", "#1"}) {
    const Clip clip = parse_bvh(replaced(small_bvh, "Left Leg", name), "t.bvh");
    std::string want = name;
    if (want == "a b  c") want = "a b c";
    EXPECT_EQ(clip.skeleton.joints[1].name, want);
    EXPECT_EQ(parse_bvh(format_bvh(clip), "t.bvh").skeleton.joints[1].name, want);
  }
}

TEST(Bvh, equal_names_are_kept) {
  const Clip clip = parse_bvh(replaced(small_bvh, "JOINT Head", "JOINT Foot"), "t.bvh");
  EXPECT_EQ(clip.skeleton.joints[2].name, clip.skeleton.joints[3].name);
  EXPECT_LT(largest_distance(clip, parse_bvh(format_bvh(clip), "t.bvh")), 1e-6);
}

TEST(Bvh, a_name_that_the_format_cannot_hold_is_written_so_that_it_reads_back) {
  Clip clip = random_clip(1, 2);
  clip.skeleton.joints[1].name = "a{b}\nc";
  clip.skeleton.joints[2].name = " ";
  const Clip again = parse_bvh(format_bvh(clip), "t.bvh");
  EXPECT_EQ(again.skeleton.joints[1].name, "a_b__c");
  EXPECT_EQ(again.skeleton.joints[2].name, "_");
}

TEST(Bvh, an_end_site_beside_children_is_passed_over) {
  const std::string text = replaced(small_bvh, "    JOINT Foot", "    End Site { OFFSET 9 9 9 }\n    JOINT Foot");
  const Clip clip = parse_bvh(text, "t.bvh");
  EXPECT_EQ(clip.skeleton.joint_count(), 4);
  EXPECT_FALSE(clip.skeleton.joints[1].end_site);
}

TEST(Bvh, a_frame_time_that_is_one_over_a_whole_number_gives_that_rate) {
  const auto rate = [](const char* time) { return parse_bvh(replaced(small_bvh, "0.0333333", time), "t.bvh").rate_hz; };
  EXPECT_EQ(rate("0.0333333"), 30);
  EXPECT_EQ(rate("0.008333"), 120);
  EXPECT_EQ(rate(".00833333"), 120);
  EXPECT_EQ(rate("0.04"), 25);
  EXPECT_EQ(rate("1"), 1);
  EXPECT_DOUBLE_EQ(rate("0.0166834"), 1 / 0.0166834) << "59.94 Hz is not 60";
  EXPECT_DOUBLE_EQ(rate("2.5"), 0.4);
}

TEST(Bvh, the_rate_survives_writing) {
  for (const double rate : {1.0, 24.0, 25.0, 29.97, 30.0, 59.94, 60.0, 119.88, 120.0, 240.0, 1000.0, 0.4, 33.3333}) {
    Clip clip = random_clip(1, 2);
    clip.rate_hz = rate;
    EXPECT_NEAR(parse_bvh(format_bvh(clip), "t.bvh").rate_hz, rate, 1e-12 * rate);
  }
}

TEST(Bvh, writing_and_reading_keeps_tree_and_motion) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const Clip clip = random_clip(seed, seed == 1 ? 1 : seed == 2 ? 2 : 300);
    const Clip again = parse_bvh(format_bvh(clip), "again.bvh");
    EXPECT_TRUE(again.skeleton.same_tree(clip.skeleton));
    EXPECT_EQ(again.frames, clip.frames);
    EXPECT_EQ(again.rate_hz, clip.rate_hz);
    EXPECT_LT(largest_distance(clip, again), 1e-5);
  }
}

TEST(Bvh, what_was_written_once_is_written_the_same_again) {
  const std::string once = format_bvh(parse_bvh(format_bvh(random_clip(3, 50)), "t.bvh"));
  EXPECT_EQ(format_bvh(parse_bvh(once, "t.bvh")), once);
}

TEST(Bvh, written_angles_do_not_jump) {
  const Clip clip = random_clip(5, 2000);  // wanders over many turns
  const std::string text = format_bvh(clip);
  std::istringstream lines(text.substr(text.find("Frame Time")));
  std::string line;
  std::getline(lines, line);
  std::vector<double> before;
  while (std::getline(lines, line)) {
    std::vector<double> row;
    const char* at = line.data();
    const char* const end = at + line.size();
    for (double value = 0; (at = scan_number(at, end, value)) != nullptr;) {
      row.push_back(value);
      while (at != end && is_space(*at)) ++at;
    }
    for (std::size_t i = 0; i < before.size(); ++i) ASSERT_LT(std::abs(row[i] - before[i]), 100);
    before = row;
  }
}

TEST(Bvh, a_rotation_that_the_channels_cannot_express_gets_more_channels) {
  Clip clip = random_clip(2, 5);
  for (int f = 0; f < 5; ++f) clip.set_rotation(6, f, turn(30 * f, Eigen::Vector3d(1, 2, 3).normalized()));
  clip.set_rotation(4, 2, turn(20, x));              // a joint without channels
  clip.require_translation_track(5).values[1] += x;  // a joint without positions
  const Clip again = parse_bvh(format_bvh(clip), "t.bvh");
  EXPECT_LT(largest_distance(clip, again), 1e-5);
  EXPECT_EQ(again.skeleton.joints[6].channels.size(), 3u);
  EXPECT_LT(again.rotation(4, 2).angularDistance(turn(20, x)), 1e-7);
}

TEST(Bvh, a_skeleton_whose_joints_are_not_in_depth_first_order_keeps_its_motion) {
  Clip clip = random_clip(4, 20);
  auto& joints = clip.skeleton.joints;  // 0 1 2 ...: put the leg (5) before the head (2) by swapping them
  std::swap(joints[2], joints[5]);
  for (auto& joint : joints) joint.parent = joint.parent == 2 ? 5 : joint.parent == 5 ? 2 : joint.parent;
  for (int f = 0; f < clip.frames; ++f) {
    const auto q = clip.rotation(2, f);
    clip.set_rotation(2, f, clip.rotation(5, f));
    clip.set_rotation(5, f, q);
  }
  EXPECT_LT(largest_distance_by_name(clip, parse_bvh(format_bvh(clip), "t.bvh")), 1e-5);
}

TEST(Bvh, a_clip_of_rest_without_any_channel_can_be_written) {
  Skeleton s;
  s.joints.push_back({.name = "only", .offset = {1, 2, 3}});
  const Clip clip = make_clip("c", s, 30, 2);
  EXPECT_EQ(largest_distance(clip, parse_bvh(format_bvh(clip), "t.bvh")), 0);
}

TEST(Bvh, files_are_written_whole_or_not_at_all) {
  const TemporaryFolder folder;
  const Clip clip = random_clip(6, 4);
  write_bvh(folder / "a b'\".bvh", clip);
  const Clip again = read_bvh(folder / "a b'\".bvh");
  EXPECT_EQ(again.name, "a b'\"");
  EXPECT_LT(largest_distance(clip, again), 1e-5);
  EXPECT_THROW(write_bvh(folder / "no" / "such.bvh", clip), Error);
}

// Two joints with six channels each, in a skeleton of that many units; the second's Y goes up and down by `size`.
std::string shaken_bvh(double reach, double size) {
  std::string out =
      "HIERARCHY\nROOT a\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation "
      "Yrotation\n JOINT b\n {\n OFFSET 0 " +
      std::to_string(reach) +
      " 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n End Site\n {\n "
      "OFFSET 0 1 0\n }\n }\n}\nMOTION\nFrames: 4\nFrame Time: 0.01\n";
  for (int f = 0; f < 4; ++f) {
    char line[200];
    std::snprintf(line, sizeof line, "%d 0 0 0 0 0  0 %.15f 0 0 0 0\n", f, reach + (f % 2 == 0 ? size : -size));
    out += line;
  }
  return out;
}

TEST(Bvh, a_joint_that_moves_by_rounding_keeps_its_offset) {
  for (const double size : {0.0, 1e-12, 1e-6, 0.004}) {
    const Clip clip = parse_bvh(shaken_bvh(120, size), "x.bvh");
    EXPECT_EQ(clip.translation_track(1), nullptr) << size;
    EXPECT_EQ(clip.skeleton.joints[1].offset.y(), 120) << size;
    ASSERT_NE(clip.translation_track(0), nullptr);
  }
  const Clip clip = parse_bvh(shaken_bvh(120, 0.02), "x.bvh");
  ASSERT_NE(clip.translation_track(1), nullptr);
  EXPECT_EQ(clip.translation_track(1)->values[1].y(), 119.98);
}

// A person of 1.2 units: what moves by 0.004 of them moves by centimetres.
TEST(Bvh, what_is_rounding_goes_with_the_size_of_the_skeleton) {
  EXPECT_NE(parse_bvh(shaken_bvh(1.2, 0.004), "x.bvh").translation_track(1), nullptr);
  EXPECT_EQ(parse_bvh(shaken_bvh(1.2, 1e-6), "x.bvh").translation_track(1), nullptr);
}

}  // namespace
}  // namespace kinespace::test
