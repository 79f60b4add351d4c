#include "kinespace/codecs/stream/pose_vectors.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/codecs/pose_space/position_metric.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

Clip back_from_vectors(const Clip& clip) {
  const ReferencePose reference = reference_pose({&clip, 1});
  const PoseVectors vectors = pose_vectors(clip, reference);
  Clip out = make_clip(clip.name, clip.skeleton, clip.rate_hz, clip.frames);
  for (const SideTrack& track : vectors.side_tracks) apply_side_track(track, 0, out);
  PoseWriter(reference, vectors.placement, out).write(vectors.values, 0, clip.frames);
  return out;
}

TEST(PoseVectors, a_clip_comes_back) {
  for (const SampleMotion& motion : sample_library({.takes = 1})) {
    const ClipErrorSums error = clip_error(motion.clip, back_from_vectors(motion.clip), 0, motion.clip.frames, 0);
    EXPECT_LT(error.largest, 1e-9) << motion.clip.name;
    EXPECT_LT(error.shell_cm(), 1e-9) << motion.clip.name;
  }
}

TEST(PoseVectors, somersaults_and_full_turns_of_a_joint_come_back) {
  Clip clip = make_clip("somersault", sample_skeleton(), 60, 400);
  for (int f = 0; f < clip.frames; ++f) {
    clip.set_rotation(0, f, Eigen::Quaterniond(Eigen::AngleAxisd(0.07 * f, Eigen::Vector3d::UnitX())));
    clip.set_rotation(7, f, Eigen::Quaterniond(Eigen::AngleAxisd(0.11 * f, Eigen::Vector3d(0, 0.6, 0.8))));
  }
  const ClipErrorSums error = clip_error(clip, back_from_vectors(clip), 0, clip.frames, 0);
  EXPECT_LT(error.largest, 1e-9);
}

TEST(PoseVectors, parameters_stay_small_and_jump_only_where_they_say) {
  Clip clip = make_clip("spin", sample_skeleton(), 60, 400);
  for (int f = 0; f < clip.frames; ++f) {
    clip.set_rotation(5, f, Eigen::Quaterniond(Eigen::AngleAxisd(0.05 * f, Eigen::Vector3d::UnitX())));
  }
  const PoseVectors vectors = pose_vectors(clip, reference_pose({&clip, 1}));
  ASSERT_FALSE(vectors.jumps.empty());
  const int dimensions = static_cast<int>(vectors.values.size()) / clip.frames;
  for (int d = 4; d < dimensions; ++d) {
    const auto curve = vectors.curve(d);
    for (int f = 1; f < clip.frames; ++f) {
      const bool jump = std::ranges::find(vectors.jumps, f) != vectors.jumps.end();
      EXPECT_LT(std::abs(curve[static_cast<std::size_t>(f)]), 5.5);
      EXPECT_LT(std::abs(curve[static_cast<std::size_t>(f)] - curve[static_cast<std::size_t>(f - 1)]), jump ? 20 : 0.3);
    }
  }
}

TEST(PoseVectors, clips_that_walk_off_in_other_directions_look_alike) {
  Clip clip = sample_library({.takes = 1}).front().clip;
  Clip turned = clip;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY()));
  for (int f = 0; f < clip.frames; ++f) {
    turned.set_rotation(0, f, turn * clip.rotation(0, f));
    auto& p = turned.require_translation_track(0).values[static_cast<std::size_t>(f)];
    p = turn * p + Eigen::Vector3d(8000, 0, -1600);
  }
  const ReferencePose reference = reference_pose({&clip, 1});
  const PoseVectors a = pose_vectors(clip, reference);
  const PoseVectors b = pose_vectors(turned, reference);
  for (std::size_t i = 0; i < a.values.size(); ++i) EXPECT_NEAR(a.values[i], b.values[i], 8.0);
  for (int d = 4; d < reference.dimensions(); ++d) {
    for (std::size_t f = 0; f < a.curve(d).size(); ++f) EXPECT_NEAR(a.curve(d)[f], b.curve(d)[f], 0.1);
  }
}

TEST(PositionMetric, is_how_far_joints_and_their_shells_move) {
  const Clip clip = sample_library({.takes = 1}).front().clip;
  const ReferencePose reference = reference_pose({&clip, 1});
  const PoseVectors vectors = pose_vectors(clip, reference);
  const int frame = clip.frames / 3;
  std::vector<double> pose;
  for (int d = 0; d < reference.dimensions(); ++d) pose.push_back(vectors.curve(d)[static_cast<std::size_t>(frame)]);
  const PoseMetric metric = pose_metric(clip.skeleton, reference, pose);
  const auto stand = [&](const std::vector<double>& at) {
    Clip one = slice(clip, frame, 1);
    PoseWriter(reference, vectors.placement, one).write(at, 0, 1);
    std::vector<JointFrame> out;
    world_frames(one, 0, out);
    return out;
  };
  const double h = 1e-5;
  for (int d = 0; d < reference.dimensions(); ++d) {
    std::vector<double> moved = pose;
    moved[static_cast<std::size_t>(d)] += h;
    const auto a = stand(pose);
    const auto b = stand(moved);
    double positions = 0, shell = 0;
    for (std::size_t j = 0; j < a.size(); ++j) {
      const Eigen::Vector3d apart = b[j].position - a[j].position;
      const Eigen::Matrix3d turned = 3 * (b[j].rotation.toRotationMatrix() - a[j].rotation.toRotationMatrix());
      positions += apart.squaredNorm();
      shell += (turned.colwise() + apart).squaredNorm() / 3;
    }
    EXPECT_NEAR(metric.positions(d, d), positions / (h * h), 1e-3 * (1 + metric.positions(d, d))) << d;
    EXPECT_NEAR(metric.shell(d, d), shell / (h * h), 1e-3 * (1 + metric.shell(d, d))) << d;
  }
}

}  // namespace
}  // namespace kinespace
