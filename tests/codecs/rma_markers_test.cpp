// Virtual markers and root alignment: what they keep, and which motion has six degrees taken out.
#include <numbers>

#include <gtest/gtest.h>

#include "kinespace/codecs/rma/markers.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"
#include "tests/codecs/sample_stream.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::data_folder;

std::vector<Eigen::Quaterniond> some_rotations(int joints, int seed) {
  std::vector<Eigen::Quaterniond> out;
  for (int j = 0; j < joints; ++j) {
    const double a = std::sin(1.7 * j + seed) * 1.4;
    const Eigen::Vector3d axis(std::sin(j + 2.0 * seed), std::cos(3.0 * j), std::sin(5.0 * j + seed));
    out.emplace_back(Eigen::AngleAxisd(a, axis.normalized()));
  }
  return out;
}

// The largest angle between what goes in and what comes back.
double round_trip(const Skeleton& skeleton, int seed) {
  const MarkerRig rig(skeleton);
  MarkerRig::Scratch scratch;
  const auto there = some_rotations(rig.joint_count(), seed);
  std::vector<double> markers(static_cast<std::size_t>(rig.dimensions()));
  rig.place({1, 2, 3}, there, scratch, markers);
  std::vector<Eigen::Quaterniond> back(there.size());
  rig.rotations(markers, scratch, back);
  double largest = 0;
  for (std::size_t j = 0; j < there.size(); ++j) {
    largest = std::max(largest, 2 * (there[j].conjugate() * back[j]).vec().norm());
  }
  return largest;
}

TEST(RmaMarkers, rotations_come_back_from_markers_twist_included) {
  const Skeleton& skeleton = test::sample_clips().front().skeleton;
  for (int seed = 0; seed < 20; ++seed) EXPECT_LT(round_trip(skeleton, seed), 1e-6) << seed;
}

TEST(RmaMarkers, bones_without_length_keep_their_twist) {
  Skeleton skeleton;
  const std::vector<Channel> turns{Channel::z_rotation, Channel::x_rotation, Channel::y_rotation};
  skeleton.joints.push_back({.name = "root", .parent = -1, .channels = turns});
  skeleton.joints.push_back({.name = "at the root", .parent = 0, .channels = turns});
  skeleton.joints.push_back({.name = "fixed", .parent = 1, .offset = {0, 1, 0}});
  skeleton.joints.push_back({.name = "hand", .parent = 2, .offset = {0, 9, 1}, .channels = turns});
  skeleton.joints.back().end_site = Eigen::Vector3d::Zero();
  for (int seed = 0; seed < 20; ++seed) EXPECT_LT(round_trip(skeleton, seed), 1e-6) << seed;
}

TEST(RmaMarkers, markers_of_bones_that_are_no_longer_rigid_are_aimed_at) {
  const Skeleton& skeleton = test::sample_clips().front().skeleton;
  const MarkerRig rig(skeleton);
  MarkerRig::Scratch scratch;
  const auto there = some_rotations(rig.joint_count(), 3);
  std::vector<double> markers(static_cast<std::size_t>(rig.dimensions()));
  rig.place({0, 0, 0}, there, scratch, markers);
  for (std::size_t i = 3; i < markers.size(); ++i) markers[i] += 0.01 * std::sin(7.0 * static_cast<double>(i));
  std::vector<Eigen::Quaterniond> back(there.size());
  rig.rotations(markers, scratch, back);
  std::vector<double> again(markers.size());
  rig.place({0, 0, 0}, back, scratch, again);
  // Nothing piles up along the limbs: every marker is off by no more than a few times what it was moved by.
  for (std::size_t i = 0; i < markers.size(); ++i) EXPECT_NEAR(again[i], markers[i], 0.05) << i;
}

TEST(RmaMarkers, markers_in_one_point_give_a_posture_all_the_same) {
  const MarkerRig rig(test::sample_clips().front().skeleton);
  MarkerRig::Scratch scratch;
  std::vector<Eigen::Quaterniond> back(static_cast<std::size_t>(rig.joint_count()));
  rig.rotations(std::vector<double>(static_cast<std::size_t>(rig.dimensions()), 0.0), scratch, back);
  for (const Eigen::Quaterniond& q : back) EXPECT_NEAR(q.norm(), 1, 1e-12);
}

TEST(RmaMarkers, the_table_has_every_frame_and_does_not_know_where_the_body_is_or_faces) {
  std::vector<Clip> clips(test::sample_clips().begin(), test::sample_clips().begin() + 2);
  Clip turned = clips[0];
  const int root = turned.skeleton.travel_root();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(2.1, Eigen::Vector3d::UnitY()));
  for (int f = 0; f < turned.frames; ++f) {
    auto& at = turned.require_translation_track(root).values[static_cast<std::size_t>(f)];
    at = turn * at + Eigen::Vector3d(300, 0, -70);
    turned.set_rotation(root, f, turn * turned.rotation(root, f));
  }
  clips[1] = turned;
  const FrameTable table = marker_table(clips);
  ASSERT_EQ(table.frames, 2 * clips[0].frames);
  ASSERT_EQ(table.starts, (std::vector<std::int64_t>{0, clips[0].frames}));
  for (int f = 0; f < clips[0].frames; f += 7) {
    const auto a = table.frame(f);
    const auto b = table.frame(clips[0].frames + f);
    for (std::size_t k = 0; k < a.size(); ++k) ASSERT_NEAR(a[k], b[k], 1e-3) << f << " " << k;
  }
}

TEST(RmaMarkers, walking_has_four_degrees_taken_out) {
  const AlignedClips aligned = align_clips(test::sample_clips());
  for (std::size_t c = 0; c < aligned.degrees.size(); ++c) {
    EXPECT_EQ(aligned.degrees[c], 4) << test::sample_clips()[c].name;
  }
}

TEST(RmaMarkers, a_body_that_turns_over_has_six_degrees_taken_out_and_then_keeps_its_posture) {
  Clip clip = slice(test::sample_clips().front(), 0, 1);
  Clip tumbling = make_clip("tumbling", clip.skeleton, 30, 90);
  const int root = clip.skeleton.travel_root();
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    for (int f = 0; f < 90; ++f) tumbling.set_rotation(j, f, clip.rotation(j, 0));
  }
  auto& travel = tumbling.require_translation_track(root).values;
  for (int f = 0; f < 90; ++f) {
    const Eigen::Quaterniond over(Eigen::AngleAxisd(2 * std::numbers::pi * f / 45, Eigen::Vector3d::UnitX()));
    tumbling.set_rotation(root, f, over * clip.rotation(root, 0));
    travel[static_cast<std::size_t>(f)] = {0, 90 + 30 * std::sin(0.1 * f), 2.0 * f};
  }
  const std::vector<Clip> clips{tumbling};
  const AlignedClips aligned = align_clips(clips);
  ASSERT_EQ(aligned.degrees.front(), 6);
  const FrameTable table = marker_table(aligned);
  for (int f = 1; f < 90; ++f) {
    for (int k = 0; k < table.dimensions; ++k) {
      ASSERT_NEAR(table.frame(f)[static_cast<std::size_t>(k)], table.frame(0)[static_cast<std::size_t>(k)], 1e-3) << f;
    }
  }
}

TEST(RmaMarkers, climbing_and_hanging_has_six_degrees_taken_out_in_some_clips) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  std::vector<Clip> clips;
  for (const auto& entry : std::filesystem::directory_iterator(data / "cmu" / "01")) {
    if (is_motion_file(entry.path())) clips.push_back(read_clip(entry.path()));
  }
  const AlignedClips aligned = align_clips(clips);
  EXPECT_GT(std::ranges::count(aligned.degrees, 6), 0);
}

}  // namespace
}  // namespace kinespace
