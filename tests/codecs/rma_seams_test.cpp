// Jerks where decoded clips meet: the limit is kept, the rest stays.
#include <algorithm>
#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/codecs/rma/detail/seam_easing.h"
#include "kinespace/codecs/rma/rma_codec.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::data_folder;

// A walk whose arms and place jump at a frame.
Clip jumping_walk(int seam) {
  Clip clip = make_walk().clip;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()));
  const std::vector<int> joints = clip.skeleton.rotating_joints();
  for (int f = seam; f < clip.frames; ++f) {
    for (std::size_t j = joints.size() / 2; j < joints.size(); ++j) {
      clip.set_rotation(joints[j], f, turn * clip.rotation(joints[j], f));
    }
    clip.require_translation_track(joints.front()).values[static_cast<std::size_t>(f)].x() += 12;
  }
  return clip;
}

bool same_frame(const Clip& a, const Clip& b, int frame) {
  for (int j = 0; j < a.skeleton.joint_count(); ++j) {
    if (a.rotation(j, frame).coeffs() != b.rotation(j, frame).coeffs()) return false;
    if (a.translation(j, frame) != b.translation(j, frame)) return false;
  }
  return true;
}

TEST(RmaSeamEasing, a_jump_is_brought_within_the_limit_and_frames_out_of_reach_stay) {
  constexpr int seam = 60;
  const Clip jumping = jumping_walk(seam);
  constexpr double limit = 60;
  ASSERT_GT(speed_change_at_seam(jumping, seam), 3 * limit);
  Clip eased = jumping;
  ease_seams(eased, std::array{seam}, limit);
  EXPECT_LE(speed_change_at_seam(eased, seam), limit);
  const int reach = static_cast<int>(0.4 * eased.rate_hz);
  for (int f = 0; f < eased.frames; ++f) {
    if (f < seam - reach || f >= seam + reach) {
      EXPECT_TRUE(same_frame(eased, jumping, f)) << f;
    }
    for (int j = 0; j < eased.skeleton.joint_count(); ++j) EXPECT_NEAR(eased.rotation(j, f).norm(), 1, 1e-12);
  }
}

TEST(RmaSeamEasing, seams_within_the_limit_are_left_alone) {
  const Clip walk = make_walk().clip;
  Clip eased = walk;
  ease_seams(eased, std::array{40, 60},
             1.01 * std::max(speed_change_at_seam(walk, 40), speed_change_at_seam(walk, 60)));
  EXPECT_EQ(eased.rotations, walk.rotations);
  Clip without_limit = jumping_walk(60);
  ease_seams(without_limit, std::array{60}, 0);
  EXPECT_EQ(without_limit.rotations, jumping_walk(60).rotations);
}

TEST(RmaSeamEasing, nothing_reaches_across_a_break) {
  constexpr int seam = 60;
  const Clip jumping = jumping_walk(seam);
  Clip eased = jumping;
  ease_seams(eased, std::array{seam}, 1, std::array{seam - 4, seam + 3});
  for (int f = 0; f < eased.frames; ++f) {
    if (f < seam - 4 || f >= seam + 3) {
      EXPECT_TRUE(same_frame(eased, jumping, f)) << f;
    }
  }
}

TEST(RmaSeamEasing, clips_of_few_frames_and_seams_at_their_ends_are_taken) {
  for (const int frames : {2, 3, 4, 7}) {
    const Clip clip = slice(jumping_walk(60), 60 - frames / 2, frames);
    for (int seam = 1; seam < frames; ++seam) {
      Clip eased = clip;
      ease_seams(eased, std::array{seam}, 1e-3);
      for (const double q : eased.rotations) EXPECT_TRUE(std::isfinite(q));
    }
  }
}

// The jerks at seams of both profiles against those elsewhere in the same decoded motion.
TEST(RmaSeamEasing, decoded_recordings_do_not_jerk_more_at_seams_than_elsewhere) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const std::vector<Clip> clips{read_clip(data / "cmu" / "02" / "02_01.amc"),
                                read_clip(data / "cmu" / "01" / "01_10.amc")};
  for (const double profile : {0.0, 1.0}) {
    const Bytes stream = encode("rma", clips, {.target = {.mean_error_cm = 2.4}, .settings = {{"profile", profile}}});
    const std::vector<Clip> decoded = open_stream(stream, "s")->decode_all();
    const auto seams = rma_seams(stream, "s");
    double at_seams = 0;
    std::vector<double> elsewhere;
    for (std::size_t c = 0; c < decoded.size(); ++c) {
      const JointPositions p = joint_positions(decoded[c]);
      for (int f = 1; f + 1 < decoded[c].frames; ++f) {
        const bool meets = std::ranges::count(seams[c], f) + std::ranges::count(seams[c], f + 1) > 0;
        for (int j = 0; j < p.joints; ++j) {
          const double change = std::abs((p.at(f + 1, j) - p.at(f, j)).norm() - (p.at(f, j) - p.at(f - 1, j)).norm());
          if (meets) at_seams = std::max(at_seams, change);
          if (!meets) elsewhere.push_back(change);
        }
      }
    }
    std::ranges::sort(elsewhere);
    ASSERT_GT(at_seams, 0) << "profile " << profile << ": no seams";
    EXPECT_LE(at_seams, elsewhere[static_cast<std::size_t>(0.999 * static_cast<double>(elsewhere.size()))])
        << "profile " << profile;
  }
}

}  // namespace
}  // namespace kinespace
