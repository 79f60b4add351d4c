#include "kinespace/motion/asf.h"

#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/motion/sample_clips.h"

namespace kinespace::test {
namespace {

using testing::HasSubstr;

constexpr double inch = 2.54 / 0.45;

Asf parse(std::string_view text) {
  return parse_asf(text, "t.asf");
}

Eigen::Quaterniond turn(double degrees, int axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::Unit(axis)));
}

TEST(Asf, a_bone_becomes_a_joint_where_it_starts_and_its_end_an_end_site) {
  const Asf asf = parse(small_asf);
  const auto& joints = asf.skeleton.joints;
  ASSERT_EQ(joints.size(), 4u);
  EXPECT_EQ(joints[0].name, "root");
  EXPECT_EQ(joints[1].name, "hip");
  EXPECT_EQ(joints[1].parent, 0);
  EXPECT_EQ(joints[1].offset, Eigen::Vector3d::Zero());
  EXPECT_EQ(joints[2].parent, 1);
  EXPECT_LT((joints[2].offset - Eigen::Vector3d(1.5, -2, 0) * inch).norm(), 1e-12);
  EXPECT_LT((joints[3].offset - Eigen::Vector3d(0, -7, 0) * inch).norm(), 1e-12);
  ASSERT_TRUE(joints[3].end_site);
  EXPECT_LT((*joints[3].end_site - Eigen::Vector3d(0, -7.5, 0) * inch).norm(), 1e-12);
  EXPECT_FALSE(joints[0].end_site || joints[1].end_site || joints[2].end_site);
}

TEST(Asf, joints_have_channels_by_their_dofs) {
  using enum Channel;
  const auto joints = parse(small_asf).skeleton.joints;
  EXPECT_EQ(joints[0].channels, (std::vector{x_position, y_position, z_position, z_rotation, y_rotation, x_rotation}));
  EXPECT_TRUE(joints[1].channels.empty());
  EXPECT_EQ(joints[2].channels, (std::vector{z_rotation, y_rotation, x_rotation}));
  EXPECT_EQ(joints[3].channels, joints[2].channels) << "one dof about a turned axis needs three angles";
  const Asf moving = parse(replaced(small_asf, "dof rx\n", "dof TZ tx\n"));
  EXPECT_EQ(moving.skeleton.joints[3].channels, (std::vector{x_position, y_position, z_position}));
  EXPECT_EQ(moving.bones[3].dofs, (std::vector{z_position, x_position}));
}

TEST(Asf, the_axis_turns_about_its_letters_from_left_to_right) {
  EXPECT_LT(parse(small_asf).bones[2].axis.angularDistance(turn(30, 2) * turn(20, 1) * turn(10, 0)), 1e-14);
  const Asf zyx = parse(replaced(small_asf, "axis 10 20 30 XYZ", "axis 10 20 30 ZYX"));
  EXPECT_LT(zyx.bones[2].axis.angularDistance(turn(10, 0) * turn(20, 1) * turn(30, 2)), 1e-14);
  const Asf yzx = parse(replaced(small_asf, "axis 10 20 30 XYZ", "axis 10 20 30 yzx"));
  EXPECT_LT(yzx.bones[2].axis.angularDistance(turn(10, 0) * turn(30, 2) * turn(20, 1)), 1e-14);
}

TEST(Asf, angles_may_be_in_radians) {
  const Asf asf = parse(replaced(replaced(small_asf, "angle deg", "angle rad"), "axis 10 20 30", "axis 0.1 0.2 0.3"));
  EXPECT_TRUE(asf.radians);
  const double degree = 180 / std::numbers::pi;
  EXPECT_LT(asf.bones[2].axis.angularDistance(turn(0.3 * degree, 2) * turn(0.2 * degree, 1) * turn(0.1 * degree, 0)),
            1e-14);
}

TEST(Asf, lengths_are_inches_over_the_length_unit) {
  EXPECT_DOUBLE_EQ(parse(small_asf).cm_per_unit, inch);
  EXPECT_DOUBLE_EQ(parse(replaced(small_asf, "length 0.45", "length 1")).cm_per_unit, 2.54);
  EXPECT_DOUBLE_EQ(parse(replaced(small_asf, "  length 0.45\n", "")).cm_per_unit, 2.54);
}

TEST(Asf, the_root_has_its_own_order_axis_and_place) {
  std::string text = replaced(small_asf, "order TX TY TZ RX RY RZ", "order RZ TX RY TZ RX TY");
  text = replaced(replaced(text, "axis XYZ\n", "axis ZXY\n"), "position 0 0 0", "position 1 2 3");
  const Asf asf = parse(text);
  using enum Channel;
  EXPECT_EQ(asf.bones[0].dofs, (std::vector{z_rotation, x_position, y_rotation, z_position, x_rotation, y_position}));
  EXPECT_EQ(asf.root_axes, (std::array<int, 3>{1, 0, 2}));
  EXPECT_LT((asf.skeleton.joints[0].offset - Eigen::Vector3d(1, 2, 3) * inch).norm(), 1e-12);
}

TEST(Asf, parents_come_before_their_children_in_whatever_order_the_file_has_them) {
  std::string text(small_asf);
  const auto bone = [&](const std::string& name) {
    const auto at = text.find("name " + name);
    const auto begin = text.rfind("  begin", at);
    const auto end = text.find("  end\n", at) + 6;
    std::string cut = text.substr(begin, end - begin);
    text.erase(begin, end - begin);
    return cut;
  };
  const std::string tibia = bone("tibia");
  const std::string hip = bone("hip");
  text = replaced(text, ":bonedata\n", ":bonedata\n" + tibia);
  text = replaced(text, ":hierarchy\n", hip + ":hierarchy\n");
  const auto joints = parse(text).skeleton.joints;
  ASSERT_EQ(joints.size(), 4u);
  EXPECT_EQ(joints[1].name, "hip");
  EXPECT_EQ(joints[2].name, "femur");
  EXPECT_EQ(joints[3].name, "tibia");
}

TEST(Asf, comments_commas_parentheses_and_line_ends_do_not_matter) {
  const Asf plain = parse(small_asf);
  std::string text = replaced(small_asf, "direction 0.6 -0.8 0", "direction (0.6, -0.8, 0) # where it goes");
  text = replaced(text, ":bonedata", "# bones\n\n:BONEDATA");
  std::string crlf;
  for (const char c : text) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  for (const std::string& other : {text, crlf}) {
    const Asf asf = parse(other);
    EXPECT_TRUE(asf.skeleton.same_tree(plain.skeleton));
    EXPECT_EQ(asf.skeleton.joints[2].offset, plain.skeleton.joints[2].offset);
  }
}

void expect_error(std::string_view text, const std::string& found, const std::string& expected, int line) {
  SCOPED_TRACE(found + " / " + expected);
  const ErrorDetails error = error_of([&] { static_cast<void>(parse(text)); });
  EXPECT_EQ(error.file, "t.asf");
  EXPECT_EQ(error.line, line);
  EXPECT_THAT(error.found, HasSubstr(found));
  EXPECT_THAT(error.expected, HasSubstr(expected));
}

TEST(AsfBadInput, a_cycle_in_the_hierarchy) {
  expect_error(
      replaced(small_asf, "root hip\n    hip femur\n    femur tibia", "root hip\n    femur tibia\n    tibia femur"),
      "\"femur\" above itself: a cycle", "a tree", 25);
  expect_error(replaced(small_asf, "root hip", "tibia hip"), "cycle", "a tree", 18);
  expect_error(replaced(small_asf, "root hip", "hip hip"), "cycle", "a tree", 18);
  expect_error(replaced(small_asf, "hip femur", "hip root"), "the root below a bone", "above all", 46);
}

TEST(AsfBadInput, bones_out_of_the_hierarchy_or_twice_in_it) {
  expect_error(replaced(small_asf, "    femur tibia\n", ""), "\"tibia\" not in the hierarchy", "a parent", 36);
  expect_error(replaced(small_asf, "femur tibia", "femur tibia hip"), "\"hip\" a second time", "one parent", 47);
  expect_error(replaced(small_asf, "femur tibia", "femur toes"), "unknown bone \"toes\"", ":bonedata", 47);
  expect_error(small_asf.substr(0, small_asf.find(":hierarchy")), "not in the hierarchy", "a parent", 18);
}

TEST(AsfBadInput, bones_that_are_not_whole) {
  expect_error(replaced(small_asf, "name femur", "name hip"), "\"hip\" a second time", "different", 25);
  expect_error(replaced(small_asf, "name femur", "name"), "name of several words or none", "one word", 25);
  expect_error(replaced(small_asf, "    name femur\n", ""), "without a name", "a name", 32);
  expect_error(replaced(small_asf, "    direction 0.6 -0.8 0\n", ""), "\"hip\" without direction or length", "both",
               21);
  expect_error(replaced(small_asf, "    length 2.5\n", ""), "\"hip\" without direction or length", "both", 21);
  expect_error(replaced(small_asf, "direction 0.6 -0.8 0", "direction 0.6 -0.8"), "too few", "direction", 19);
  expect_error(replaced(small_asf, "direction 0.6", "direction nan"), "\"nan\"", "direction", 19);
  expect_error(replaced(small_asf, "length 2.5", "length 1e12"), "\"1e12\"", "length", 20);
  expect_error(replaced(small_asf, "axis 10 20 30 XYZ", "axis 10 20 30 XXZ"), "\"XXZ\"", "X, Y and Z", 28);
  expect_error(replaced(small_asf, "  end\n  begin\n    id 3", "  begin\n    id 3"), "begin inside a bone", "end", 33);
  expect_error(replaced(small_asf, "id 1", "id 1\n  end"), "without a name", "a name", 18);
}

TEST(AsfBadInput, dofs_that_are_none) {
  expect_error(replaced(small_asf, "dof rx ry rz", "dof rx rw"), "\"rw\"", "dofs among", 29);
  expect_error(replaced(small_asf, "dof rx ry rz", "dof rx rx"), "\"rx\"", "once", 29);
  expect_error(replaced(small_asf, "dof rx ry rz", "dof rx ry rz l"), "the dof l", "rigid", 29);
  expect_error(replaced(small_asf, "order TX TY", "order TX TX"), "\"TX\"", "once", 11);
}

TEST(AsfBadInput, units_that_are_none) {
  expect_error(replaced(small_asf, "length 0.45", "length 0"), "\"0\"", "length unit", 6);
  expect_error(replaced(small_asf, "length 0.45", "length -1"), "\"-1\"", "length unit", 6);
  expect_error(replaced(small_asf, "length 0.45", "length nan"), "\"nan\"", "length unit", 6);
  expect_error(replaced(small_asf, "length 0.45", "length"), "too few", "length unit", 6);
  expect_error(replaced(small_asf, "angle deg", "angle grad"), "\"grad\"", "deg or rad", 7);
}

TEST(AsfBadInput, an_empty_file_or_one_of_another_kind) {
  expect_error("", "no :root", "ASF", 1);
  expect_error(small_bvh, "no :root", "ASF", 36);
  expect_error(small_asf.substr(0, small_asf.find("    length 7\n")), "a bone without end", "end", 27);
}

}  // namespace
}  // namespace kinespace::test
