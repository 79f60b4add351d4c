#include "kinespace/motion/amc.h"

#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/motion/bvh.h"
#include "kinespace/motion/kinematics.h"
#include "tests/motion/sample_clips.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using testing::HasSubstr;

constexpr double inch = 2.54 / 0.45;

Eigen::Quaterniond turn(double degrees, int axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::Unit(axis)));
}
Eigen::Quaterniond zyx(double rx, double ry, double rz) {
  return turn(rz, 2) * turn(ry, 1) * turn(rx, 0);
}

Clip parse(std::string_view amc, std::string_view asf = small_asf) {
  return parse_amc(amc, parse_asf(asf, "t.asf"), "t.amc");
}

TEST(Amc, turns_each_bone_about_its_own_axes) {
  const Clip clip = parse(small_amc);
  EXPECT_EQ(clip.frames, 2);
  EXPECT_EQ(clip.rate_hz, 120);
  EXPECT_EQ(clip.name, "t");
  EXPECT_LT((clip.translation(0, 1) - Eigen::Vector3d(1.5, 18, -2) * inch).norm(), 1e-12);
  EXPECT_LT(clip.rotation(0, 0).angularDistance(zyx(10, 20, 30)), 1e-14);
  const Eigen::Quaterniond femur_axis = zyx(10, 20, 30);
  EXPECT_LT(clip.rotation(2, 0).angularDistance(femur_axis * zyx(5, -6, 7.5) * femur_axis.conjugate()), 1e-14);
  const Eigen::Quaterniond tibia_axis = zyx(0, 0, 20);
  EXPECT_LT(clip.rotation(3, 1).angularDistance(tibia_axis * zyx(26, 0, 0) * tibia_axis.conjugate()), 1e-14);
  EXPECT_EQ(clip.rotation(1, 1).coeffs(), Eigen::Quaterniond::Identity().coeffs());
}

TEST(Amc, the_order_of_dofs_only_says_how_the_values_stand) {
  const Clip plain = parse(small_amc);
  const std::string asf = replaced(replaced(small_asf, "dof rx ry rz", "dof rz rx ry"), "order TX TY TZ RX RY RZ",
                                   "order RZ RY RX TX TY TZ");
  const Clip other = parse(
      "1\nroot 30 20 10 1 18 -2\nfemur 7.5 5 -6\ntibia 25\n2\nroot 31 21 11 1.5 18 -2\nfemur 8 5 -6\ntibia 26\n", asf);
  EXPECT_EQ(other.rotations, plain.rotations);
  EXPECT_EQ(largest_distance(plain, other), 0);
}

TEST(Amc, the_roots_axis_says_how_its_rotations_compose) {
  const Clip clip = parse(small_amc, replaced(small_asf, "axis XYZ\n", "axis YXZ\n"));
  EXPECT_LT(clip.rotation(0, 0).angularDistance(turn(30, 2) * turn(10, 0) * turn(20, 1)), 1e-14);
}

TEST(Amc, a_root_without_some_dofs_rests_in_them) {
  const std::string asf =
      replaced(replaced(small_asf, "order TX TY TZ RX RY RZ", "order TY RX"), "position 0 0 0", "position 4 5 6");
  const Clip clip = parse("1\nroot 18 10\nfemur 5 -6 7.5\ntibia 25\n", asf);
  EXPECT_LT((clip.translation(0, 0) - Eigen::Vector3d(4, 18, 6) * inch).norm(), 1e-12);
  EXPECT_LT(clip.rotation(0, 0).angularDistance(turn(10, 0)), 1e-14);
}

TEST(Amc, translation_dofs_move_the_start_of_a_bone_along_its_axes) {
  const std::string asf = replaced(small_asf, "dof rx ry rz", "dof tz rx ty");
  const Clip clip =
      parse("1\nroot 0 0 0 0 0 0\nfemur 2 0 3\ntibia 25\n2\nroot 0 0 0 0 0 0\nfemur 0 0 0\ntibia 25\n", asf);
  const Eigen::Vector3d rest = Eigen::Vector3d(1.5, -2, 0) * inch;
  EXPECT_LT((clip.translation(2, 0) - rest - zyx(10, 20, 30) * Eigen::Vector3d(0, 3, 2) * inch).norm(), 1e-12);
  EXPECT_LT((clip.translation(2, 1) - rest).norm(), 1e-12);
}

TEST(Amc, angles_may_be_in_radians) {
  const Clip clip = parse(replaced(small_amc, ":DEGREES", ":RADIANS"));
  EXPECT_LT(clip.rotation(0, 0).angularDistance(
                zyx(10 * 180 / std::numbers::pi, 20 * 180 / std::numbers::pi, 30 * 180 / std::numbers::pi)),
            1e-13);
  const Clip by_skeleton = parse(replaced(small_amc, ":DEGREES\n", ""), replaced(small_asf, "angle deg", "angle rad"));
  EXPECT_LT(by_skeleton.rotation(0, 0).angularDistance(clip.rotation(0, 0)), 1e-14);
}

TEST(Amc, a_rate_in_the_file_counts) {
  EXPECT_EQ(parse(replaced(small_amc, ":DEGREES", ":SAMPLES-PER-SECOND 60")).rate_hz, 60);
}

TEST(Amc, line_ends_comments_and_the_first_frame_number_do_not_matter) {
  const Clip plain = parse(small_amc);
  std::string crlf;
  for (const char c : small_amc) crlf += c == '\n' ? std::string(" \r\n") : std::string(1, c);
  const std::string later = replaced(replaced(small_amc, "\n1\n", "\n31\n"), "\n2\n", "\n# half\n\n 32\n");
  std::string cr(small_amc);
  std::ranges::replace(cr, '\n', '\r');
  for (const std::string& text : {crlf, cr, later, std::string(small_amc.substr(0, small_amc.size() - 1))}) {
    EXPECT_EQ(parse(text).rotations, plain.rotations);
  }
}

TEST(Amc, a_bone_whose_name_starts_with_a_digit_is_no_frame) {
  const auto renamed = [](std::string_view text) {
    std::string out(text);
    for (auto at = out.find("tibia"); at != std::string::npos; at = out.find("tibia", at + 6))
      out.replace(at, 5, "1tibia");
    return out;
  };
  EXPECT_EQ(parse(renamed(small_amc), renamed(small_asf)).rotations, parse(small_amc).rotations);
}

void expect_error(std::string_view text, int line, const std::string& found, const std::string& expected = "") {
  SCOPED_TRACE(found + " / " + expected);
  const ErrorDetails error =
      error_of([&] { static_cast<void>(parse_amc(text, parse_asf(small_asf, "t.asf"), "t.amc", {.strict = true})); });
  EXPECT_EQ(error.file, "t.amc");
  EXPECT_EQ(error.line, line);
  EXPECT_THAT(error.found, HasSubstr(found));
  EXPECT_THAT(error.expected, HasSubstr(expected));
}

TEST(AmcBadInput, bones_missing_unknown_or_twice) {
  expect_error(replaced(small_amc, "tibia 25\n", ""), 7, "no values of bone \"tibia\" in frame 1", "every frame");
  expect_error(replaced(small_amc, "femur 5 -6 8\n", ""), 11, "no values of bone \"femur\" in frame 2", "every frame");
  expect_error(replaced(small_amc, "tibia 26", "toes 26"), 10, "\"toes\"", "a bone of the ASF");
  expect_error(replaced(small_amc, "tibia 26", "tibia 26\ntibia 26"), 11, "\"tibia\"", "once a frame");
  expect_error(replaced(small_amc, "tibia 26", "hip 26"), 10, "more than 0 values of bone \"hip\"", "0");
}

TEST(AmcBadInput, values_that_are_too_few_too_many_or_none) {
  expect_error(replaced(small_amc, "femur 5 -6 8", "femur 5 -6"), 11, "2 values of bone \"femur\"", "3");
  expect_error(replaced(small_amc, "femur 5 -6 8", "femur 5 -6 8 9"), 11, "more than 3 values", "3");
  expect_error(replaced(small_amc, "femur 5 -6 8", "femur"), 11, "0 values", "3");
  for (const std::string bad : {"nan", "-inf", "1e10", "1,5", "x", "1e999"}) {
    expect_error(replaced(small_amc, "femur 5 -6 8", "femur 5 " + bad + " 8"), 11, "\"" + bad + "\"", "finite number");
  }
}

TEST(Amc, frame_numbers_by_a_step_of_their_own_divide_the_rate) {
  std::vector<std::string> notes;
  const std::string text = replaced(replaced(small_amc, "\n1\n", "\n8\n"), "\n2\n", "\n12\n");
  const ClipReadOptions options{.note = [&](const std::string& what) { notes.push_back(what); }};
  const Clip clip = parse_amc(text, parse_asf(small_asf, "t.asf"), "t.amc", options);
  EXPECT_EQ(clip.rate_hz, 30);
  EXPECT_EQ(clip.rotations, parse(small_amc).rotations);
  EXPECT_THAT(notes, testing::ElementsAre(testing::HasSubstr("go up by 4")));
}

TEST(Amc, frames_left_out_are_gaps) {
  const std::size_t second = small_amc.find("\n2\n") + 1;
  std::string text(small_amc);
  for (const int number : {3, 306, 307}) {
    text += replaced(small_amc.substr(second), "2\n", std::to_string(number) + "\n");
  }
  std::vector<std::pair<int, int>> lost;
  std::vector<std::string> notes;
  const ClipReadOptions options{.lost = [&](int first, int last) { lost.emplace_back(first, last); },
                                .note = [&](const std::string& what) { notes.push_back(what); }};
  const Clip clip = parse_amc(text, parse_asf(small_asf, "t.asf"), "t.amc", options);
  ASSERT_EQ(clip.frames, 307);
  EXPECT_EQ(clip.rate_hz, 120);
  EXPECT_THAT(lost, testing::ElementsAre(testing::Pair(3, 304)));
  EXPECT_THAT(notes, testing::ElementsAre(testing::HasSubstr("302 frames are not there")));
  for (int f = 1; f < 307; ++f) {
    for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
      ASSERT_TRUE(clip.rotation(j, f).isApprox(clip.rotation(j, 1), 1e-15)) << f << " " << j;
    }
    ASSERT_EQ(clip.translation(0, f), clip.translation(0, 1)) << f;
  }
}

TEST(AmcBadInput, frames_out_of_order_or_none) {
  expect_error(replaced(small_amc, "\n2\n", "\n3\n"), 8, "\"3\"", "frame number 2");
  expect_error(replaced(small_amc, "\n2\n", "\n1\n"), 8, "\"1\"", "frame number 2");
  expect_error(replaced(small_amc, "\n1\n", "\n99999999999999999999\n"), 4, "\"999", "a frame number");
  expect_error(replaced(small_amc, "\n1\n", "\n1 2\n"), 4, "\"1\"", "a frame number");
  expect_error(replaced(small_amc, "\n1\n", "\n"), 4, "\"root\"", "a frame number");
  expect_error("", 1, "no frame", "at least one");
  expect_error("#!OML\n:FULLY-SPECIFIED\n", 3, "no frame", "at least one");
  expect_error("1\n", 2, "no values of bone \"root\"", "every frame");
  expect_error(replaced(small_amc, ":DEGREES", ":SAMPLES-PER-SECOND 0"), 3, "\"0\"", "a rate");
}

TEST(AmcBadInput, line_ends_of_several_kinds) {
  const std::string frame = "root 1 18 -2 10 20 30\rfemur 5 -6 7.5\rtibia 25";
  expect_error("1\r" + frame + "\n2\r" + frame + "\r3\r" + frame + "\n", 9, "line ends of several kinds", "the same");
}

TEST(AmcBadInput, a_file_of_frame_numbers_only_costs_no_memory) {
  std::string text;
  for (int f = 1; f <= 500000; ++f) text += std::to_string(f) + "\n";
  expect_error(text, 2, "no values of bone \"root\" in frame 1", "every frame");
}

Clip through_acclaim(const Clip& clip) {
  const AcclaimText text = format_amc(clip);
  return parse_amc(text.amc, parse_asf(text.asf, "a.asf"), "a.amc");
}

TEST(AmcWriting, keeps_world_positions_rate_and_names_of_any_clip) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const Clip clip = random_clip(seed, seed == 1 ? 1 : 200);
    const Clip again = through_acclaim(clip);
    EXPECT_EQ(again.rate_hz, 30);
    Clip named = clip;  // a space is no part of an ASF name
    for (auto& joint : named.skeleton.joints) std::ranges::replace(joint.name, ' ', '_');
    EXPECT_LT(largest_distance_by_name(named, again), 1e-5);
    EXPECT_LT(largest_distance_by_name(named, parse_bvh(format_bvh(again), "b.bvh")), 2e-5);
  }
}

TEST(AmcWriting, an_amc_comes_back_joint_by_joint) {
  const Clip clip = parse(small_amc);
  const Clip again = through_acclaim(clip);
  ASSERT_TRUE(again.skeleton.same_tree(clip.skeleton)) << "no helper bones, the same channels";
  EXPECT_LT(largest_distance(clip, again), 1e-6);
  EXPECT_LT((*again.skeleton.joints[3].end_site - *clip.skeleton.joints[3].end_site).norm(), 1e-12);
  const Clip through_bvh = parse_bvh(format_bvh(clip), "t.bvh");
  EXPECT_LT(largest_distance(clip, through_bvh), 1e-6);
  EXPECT_TRUE(through_bvh.skeleton.same_tree(clip.skeleton));
}

TEST(AmcWriting, children_that_start_apart_hang_on_helper_bones_that_do_not_multiply) {
  const Clip once = through_acclaim(random_clip(3, 3));
  EXPECT_GE(once.skeleton.find("root_to_Spine"), 0);
  EXPECT_EQ(through_acclaim(once).skeleton.joint_count(), once.skeleton.joint_count());
}

TEST(AmcWriting, names_that_the_format_cannot_hold_are_changed_and_kept_apart) {
  Clip clip = random_clip(2, 2);
  const char* names[] = {"Hips", "a b", "a_b", "12", "#c", "root", "begin"};
  for (std::size_t j = 0; j < 7; ++j) clip.skeleton.joints[j].name = names[j];
  const Clip again = through_acclaim(clip);
  for (const char* name : {"a_b", "a_b_2", "_12", "_c", "root_2", "_begin"})
    EXPECT_GE(again.skeleton.find(name), 0) << name;
}

TEST(AmcWriting, both_files_are_written) {
  const TemporaryFolder folder;
  const Clip clip = parse(small_amc);
  write_amc(folder / "a b.amc", clip);
  const Clip again = read_amc(folder / "a b.amc", folder / "a b.asf");
  EXPECT_LT(largest_distance(clip, again), 1e-6);
  EXPECT_EQ(again.name, "a b");
}

}  // namespace
}  // namespace kinespace::test
