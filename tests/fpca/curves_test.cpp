#include "kinespace/motion/curves.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/pose_features.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/uniform_spline.h"
#include "tests/fpca/sample_space.h"
#include "tests/support/long_clip.h"

namespace kinespace {
namespace {

TEST(UniformSpline, a_cubic_is_met_exactly_with_its_slope_and_integral) {
  const auto cubic = [](double x) { return 0.5 - x + 0.3 * x * x - 0.02 * x * x * x; };
  SampleMatrix samples(9, 1);
  for (int i = 0; i < 9; ++i) samples(i, 0) = cubic(i);
  const UniformSpline spline(samples);
  Eigen::RowVectorXd value(1), slope(1);
  for (const double x : {0.0, 0.3, 3.7, 7.9, 8.0}) {
    spline.value(x, value);
    spline.derivative(x, slope);
    EXPECT_NEAR(value(0), cubic(x), 1e-12);
    EXPECT_NEAR(slope(0), -1 + 0.6 * x - 0.06 * x * x, 1e-11);
  }
  const auto integral = [](double x) { return 0.5 * x - x * x / 2 + 0.1 * x * x * x - 0.005 * x * x * x * x; };
  EXPECT_NEAR(spline.cumulative_integral()(8, 0), integral(8), 1e-11);
}

TEST(UniformSpline, one_two_and_three_samples_give_a_constant_a_line_and_a_parabola) {
  Eigen::RowVectorXd value(1);
  UniformSpline(SampleMatrix::Constant(1, 1, 4.0)).value(0.7, value);
  EXPECT_EQ(value(0), 4.0);
  SampleMatrix two(2, 1), three(3, 1);
  two << 1, 3;
  three << 0, 1, 4;
  UniformSpline(two).value(0.25, value);
  EXPECT_NEAR(value(0), 1.5, 1e-14);
  UniformSpline(three).value(1.5, value);
  EXPECT_NEAR(value(0), 2.25, 1e-14);
}

TEST(Curves, the_way_there_and_back_keeps_every_joint) {
  for (const Clip& clip : test::sample_clips()) {
    const MotionError error = compare(clip, clip_from_curves(clip_curves(clip), clip.skeleton));
    EXPECT_LT(error.max_joint_error_cm, 1e-9) << clip.name;
  }
}

// Long enough that curves are made in several blocks of frames.
Clip long_clip() {
  return test::over_and_over(test::sample_clips().front(), 150'000);
}

TEST(Curves, a_clip_that_gives_up_its_memory_has_the_same_curves) {
  Clip clip = long_clip();
  const ClipCurves kept = clip_curves(clip);
  const ClipCurves taken = clip_curves(std::move(clip));
  EXPECT_EQ(taken.values, kept.values);
  EXPECT_EQ(taken.placement.start_cm, kept.placement.start_cm);
  EXPECT_EQ(taken.side_tracks.size(), kept.side_tracks.size());
}

TEST(Curves, a_part_of_a_clip_is_what_the_whole_has_there) {
  for (const Clip& clip : test::sample_clips()) {
    const ClipCurves curves = clip_curves(clip);
    const Clip whole = clip_from_curves(curves, clip.skeleton);
    const int first = clip.frames / 3;
    const int count = std::min(40, clip.frames - first);
    const Clip part = clip_of_frames(curves, curves.values.middleRows(first, count), first, clip.skeleton);
    const Clip expected = slice(whole, first, count);
    EXPECT_EQ(part.rotations, expected.rotations) << clip.name;
    for (const auto& track : expected.translations) {
      EXPECT_EQ(part.translation_track(track.joint)->values, track.values) << clip.name;
    }
  }
}

TEST(Curves, a_long_clip_made_ready_is_kept_in_parts) {
  const PreparedClip clip = prepare(long_clip());
  ASSERT_EQ(prepared_parts(clip), 3);
  const auto part_of = [&](int part) { return std::optional(pack_prepared(clip, part)); };
  const PreparedClip back = unpack_prepared(part_of, "test").value();
  EXPECT_EQ(back.curves.values, clip.curves.values.cast<float>().cast<double>());
  ASSERT_EQ(back.runs.size(), clip.runs.size());
  EXPECT_EQ(back.runs[0].cuts, clip.runs[0].cuts);
  for (int gone = 0; gone < 3; ++gone) {
    const auto without = [&](int part) { return part == gone ? std::nullopt : part_of(part); };
    EXPECT_FALSE(unpack_prepared(without, "test")) << gone;
  }
  const auto swapped = [&](int part) { return part_of(part == 1 ? 2 : part); };
  EXPECT_THROW(static_cast<void>(unpack_prepared(swapped, "test")), Error) << "a part of another length";
}

TEST(PoseFeatures, any_keyframes_are_those_of_the_whole_clip) {
  for (const Clip& clip : test::sample_clips()) {
    const ClipCurves curves = clip_curves(clip);
    for (const double rate_hz : {30.0, 25.0, curves.rate_hz}) {
      const PoseFeatures whole = pose_features(curves, clip.skeleton, {.rate_hz = rate_hz});
      const PoseFeatureSource source(curves, clip.skeleton, {.rate_hz = rate_hz});
      ASSERT_EQ(source.rows(), whole.rows);
      std::vector<float> pieces;
      for (int first = 0; first < whole.rows; first += 7) {
        source.append(first, std::min(7, whole.rows - first), pieces);
      }
      EXPECT_EQ(pieces, whole.values) << clip.name << " at " << rate_hz;
    }
  }
}

TEST(Curves, a_clip_starts_at_the_origin_with_heading_zero) {
  const ClipCurves curves = clip_curves(test::sample_clips().front());
  EXPECT_EQ(curves.values.row(0).head<3>().norm(), 0);
  const auto q = curves.values.row(0).segment<4>(3);
  EXPECT_NEAR(heading_of(Eigen::Quaterniond(q(0), q(1), q(2), q(3))), 0, 1e-12);
}

TEST(Curves, turning_a_clip_changes_its_placement_only) {
  Clip turned = test::sample_clips().front();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitY()));
  for (int f = 0; f < turned.frames; ++f) turned.set_rotation(0, f, turn * turned.rotation(0, f));
  for (auto& p : turned.require_translation_track(0).values) p = turn * p;
  const ClipCurves a = clip_curves(test::sample_clips().front());
  const ClipCurves b = clip_curves(turned);
  EXPECT_LT((a.values.cwiseAbs() - b.values.cwiseAbs()).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(std::remainder(b.placement.heading_rad - a.placement.heading_rad - 1.1, 2 * std::numbers::pi), 0, 1e-9);
}

TEST(Curves, quaternions_do_not_flip_from_frame_to_frame) {
  Clip clip = test::sample_clips().front();
  for (int f = 0; f < clip.frames; f += 2) {
    for (double& x : clip.rotation_track(3).subspan(static_cast<std::size_t>(f) * 4, 4)) x = -x;
  }
  const ClipCurves curves = clip_curves(clip);
  for (Eigen::Index f = 1; f < curves.values.rows(); ++f) {
    for (Eigen::Index c = 3; c < curves.values.cols(); c += 4) {
      EXPECT_GT(curves.values.row(f).segment<4>(c).dot(curves.values.row(f - 1).segment<4>(c)), 0);
    }
  }
}

TEST(Curves, a_moving_joint_above_the_travel_root_comes_back) {
  Skeleton skeleton;
  const std::vector<Channel> six{Channel::x_position, Channel::y_position, Channel::z_position,
                                 Channel::z_rotation, Channel::x_rotation, Channel::y_rotation};
  skeleton.joints.push_back({.name = "world", .parent = -1, .channels = six});
  skeleton.joints.push_back({.name = "hips", .parent = 0, .offset = {0, 90, 0}, .channels = six});
  skeleton.joints.push_back({.name = "head", .parent = 1, .offset = {0, 60, 0}, .channels = {Channel::x_rotation}});
  skeleton.joints.push_back({.name = "leg", .parent = 1, .offset = {0, -80, 0}, .channels = {Channel::x_rotation}});
  ASSERT_EQ(skeleton.travel_root(), 1);
  Clip clip = make_clip("carried", skeleton, 30, 40);
  for (int f = 0; f < 40; ++f) {
    clip.require_translation_track(0).values[static_cast<std::size_t>(f)] = {0, 0, 3.0 * f};
    clip.set_rotation(0, f, Eigen::Quaterniond(Eigen::AngleAxisd(0.02 * f, Eigen::Vector3d::UnitY())));
    clip.require_translation_track(1).values[static_cast<std::size_t>(f)] = {std::sin(0.2 * f), 90, 0};
  }
  const ClipCurves curves = clip_curves(clip);
  EXPECT_EQ(curves.side_tracks.size(), 2U);
  EXPECT_LT(compare(clip, clip_from_curves(curves, skeleton)).max_joint_error_cm, 1e-3);
  const auto bytes = pack_side_tracks(curves.side_tracks);
  EXPECT_EQ(unpack_side_tracks(bytes, 40, skeleton, "test").size(), 2U);
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    EXPECT_THROW(static_cast<void>(unpack_side_tracks(std::span(bytes).first(n), 40, skeleton, "test")), Error);
  }
}

}  // namespace
}  // namespace kinespace
