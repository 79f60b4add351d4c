#include "kinespace/motion/strip.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Two legs and a head on a pelvis that travels along X.
Clip two_legs(double speed_cm_s) {
  Skeleton s;
  const auto rotations = std::vector{Channel::z_rotation, Channel::x_rotation, Channel::y_rotation};
  s.joints.push_back({.name = "Hips", .offset = {0, 90, 0}, .channels = rotations});
  s.joints.push_back({.name = "LeftLeg", .parent = 0, .offset = {0, 0, 10}, .channels = rotations});
  s.joints.push_back({.name = "LeftFoot", .parent = 1, .offset = {0, -90, 0}, .channels = rotations});
  s.joints.push_back({.name = "RightLeg", .parent = 0, .offset = {0, 0, -10}, .channels = rotations});
  s.joints.push_back({.name = "RightFoot", .parent = 3, .offset = {0, -90, 0}, .channels = rotations});
  s.joints.push_back({.name = "Head", .parent = 0, .offset = {0, 70, 0}, .end_site = Eigen::Vector3d(0, 15, 0)});
  Clip clip = make_clip("legs", s, 30, 61);
  auto& track = clip.require_translation_track(0);
  for (int f = 0; f < clip.frames; ++f) track.values[static_cast<std::size_t>(f)].x() = speed_cm_s * f / clip.rate_hz;
  return clip;
}

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t out = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + word.size())) ++out;
  return out;
}

TEST(Strip, draws_the_asked_number_of_figures_at_regular_times) {
  const std::string svg = strip_svg(two_legs(0), {.figures = 5});
  EXPECT_EQ(count(svg, "<circle"), 5U);  // heads
  for (const char* time : {">0 s<", ">0.5 s<", ">1 s<", ">1.5 s<", ">2 s<"}) EXPECT_THAT(svg, HasSubstr(time));
}

TEST(Strip, draws_no_more_figures_than_frames) {
  EXPECT_EQ(count(strip_svg(slice(two_legs(0), 0, 3), {.figures = 12}), "<circle"), 3U);
  EXPECT_EQ(count(strip_svg(slice(two_legs(0), 0, 1), {.figures = 12}), "<circle"), 1U);
}

TEST(Strip, stands_figures_where_they_stood_when_they_travel) {
  // Along the path the picture is as wide as the way; the scale follows from it, and the labels are equidistant.
  const std::string far = strip_svg(two_legs(200), {.figures = 3});
  const std::string path = strip_svg(two_legs(200), {.figures = 3, .layout = StripLayout::path});
  const std::string time = strip_svg(two_legs(200), {.figures = 3, .layout = StripLayout::time});
  EXPECT_EQ(far, path);
  EXPECT_NE(far, time);
  EXPECT_EQ(strip_svg(two_legs(2), {.figures = 3}),
            strip_svg(two_legs(2), {.figures = 3, .layout = StripLayout::time}));
}

TEST(Strip, shows_plants_and_when_they_are) {
  const StripOptions options{
      .figures = 5, .layout = StripLayout::time, .marks = {{.joint = 2, .first_frame = 10, .last_frame = 35}}};
  const std::string svg = strip_svg(two_legs(20), options);
  EXPECT_EQ(count(svg, "<circle"), 5U + 2U + 1U);  // heads, the plant at 0.5 s and 1 s, its legend
  EXPECT_THAT(svg, HasSubstr(">LeftFoot<"));
}

TEST(Strip, draws_the_ghost_in_grey_behind) {
  const Clip clip = two_legs(0);
  const Clip other = slice(clip, 0, 20);  // ends before the second figure
  const std::string without = strip_svg(clip, {.figures = 3});
  const std::string with = strip_svg(clip, {.figures = 3, .view = StripView::front, .ghost = &other});
  EXPECT_EQ(count(without, "#bdbdbd"), 0U);
  EXPECT_EQ(count(with, "#bdbdbd"), 5U + 1U + 1U);  // one figure's bones and head, the legend
  EXPECT_LT(with.find("#bdbdbd"), with.find("#d1495b"));
}

TEST(Strip, puts_a_band_over_its_frames) {
  const std::string svg = strip_svg(two_legs(0), {.figures = 3, .width_px = 648, .bands = {{15, 45, "seam"}}});
  // Figures at 0, 1 and 2 s stand at 124, 324 and 524 pixels: the band reaches from 224 to 424.
  EXPECT_THAT(svg, ::testing::ContainsRegex("<rect x=\"224\" y=\"[0-9.]+\" width=\"200\""));
  EXPECT_THAT(svg, HasSubstr(">seam<"));
}

TEST(Strip, is_as_large_wherever_the_body_stands) {
  // A joint above the travel root that stays at the origin is no part of the body.
  Clip near = two_legs(2);
  for (Joint& joint : near.skeleton.joints) ++joint.parent;
  near.skeleton.joints[0].channels = {Channel::x_position, Channel::y_position, Channel::z_position};
  near.skeleton.joints.insert(near.skeleton.joints.begin(), Joint{.name = "origin"});
  for (auto& track : near.translations) ++track.joint;
  near.rotations.insert(near.rotations.begin(), near.rotations.begin(), near.rotations.begin() + 4L * near.frames);
  Clip far = near;
  for (auto& at : far.translations.front().values) at += Eigen::Vector3d(3000, 0, 2000);
  EXPECT_EQ(strip_svg(near), strip_svg(far));
}

TEST(Strip, keeps_the_picture_well_formed_whatever_the_title_holds) {
  const std::string svg = strip_svg(two_legs(0), {.title = "a<b>&\"\x01\xff\xc3\xa4"});
  EXPECT_THAT(svg, HasSubstr(">a&lt;b&gt;&amp;&quot;??\xc3\xa4<"));
  EXPECT_THAT(svg, Not(HasSubstr("\x01")));
}

TEST(Strip, writes_the_same_bytes_each_time) {
  test::TemporaryFolder folder;
  write_strip(folder / "a.svg", two_legs(50));
  write_strip(folder / "b.svg", two_legs(50));
  const auto size = std::filesystem::file_size(folder / "a.svg");
  EXPECT_GT(size, 1000U);
  EXPECT_EQ(size, std::filesystem::file_size(folder / "b.svg"));
  EXPECT_EQ(strip_svg(two_legs(50)), strip_svg(two_legs(50)));
}

TEST(Strip, refuses_options_outside_their_range_by_name) {
  const Clip clip = two_legs(0);
  const auto message = [&](const StripOptions& options) -> std::string {
    try {
      (void)strip_svg(clip, options);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::usage);
      return e.what();
    }
    return "accepted";
  };
  EXPECT_THAT(message({.figures = 0}), HasSubstr("figures = 0, expected 1 to 200"));
  EXPECT_THAT(message({.width_px = 10}), HasSubstr("width_px = 10"));
  EXPECT_THAT(message({.first_frame = 61}), HasSubstr("first_frame = 61, expected 0 to 60"));
  EXPECT_THAT(message({.first_frame = 8, .last_frame = 7}), HasSubstr("last_frame = 7, expected 8 to 60"));
  EXPECT_THAT(message({.floor_cm = std::nan("")}), HasSubstr("floor_cm"));
  EXPECT_THAT(message({.marks = {{.joint = 6}}}), HasSubstr("marks.joint = 6"));
  EXPECT_THAT(message({.bands = {{.first_frame = 0, .last_frame = 99}}}), HasSubstr("bands.last_frame = 99"));
}

TEST(BodySides, are_found_in_the_ways_skeletons_name_them) {
  const auto side = [](std::vector<std::string> names, std::size_t which) {
    Skeleton s;
    for (std::string& name : names) s.joints.push_back({.name = std::move(name), .parent = s.joint_count() - 1});
    return body_sides(s)[which];
  };
  EXPECT_EQ(side({"root", "lfemur", "rfemur"}, 1), BodySide::left);
  EXPECT_EQ(side({"root", "lfemur", "rfemur"}, 2), BodySide::right);
  EXPECT_EQ(side({"root", "lowerback"}, 1), BodySide::middle);
  EXPECT_EQ(side({"Hips", "UpperLeg_L", "UpperLeg_R"}, 1), BodySide::left);
  EXPECT_EQ(side({"Hips", "mixamorig:RightArm", "mixamorig:LeftArm"}, 1), BodySide::right);
  EXPECT_EQ(side({"Hips", "arm.r", "arm.l", "extra"}, 3), BodySide::left);  // hangs on the left arm
}

}  // namespace
}  // namespace kinespace
