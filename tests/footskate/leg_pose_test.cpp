// Posing legs in place, and back.
#include "kinespace/footskate/detail/leg_pose.h"

#include <gtest/gtest.h>

#include "tests/footskate/skating.h"

namespace kinespace {
namespace {

LegGoals lifted(const FootTracks& tracks, double by_cm) {
  LegGoals goals{.root_shift = std::vector<Eigen::Vector3d>(tracks.frames, {1, 2, 3}), .sides = {}};
  for (int leg = 0; leg < 2; ++leg) {
    goals.sides[leg].ankle = tracks.at[2 * leg];
    for (auto& p : goals.sides[leg].ankle) p.y() += by_cm;
    goals.sides[leg].foot_turn.assign(tracks.frames, Eigen::Vector3d::Zero());
  }
  return goals;
}

void expect_equal(const Clip& a, const Clip& b) {
  EXPECT_EQ(a.rotations, b.rotations);
  ASSERT_EQ(a.translations.size(), b.translations.size());
  for (std::size_t i = 0; i < a.translations.size(); ++i) {
    EXPECT_EQ(a.translations[i].joint, b.translations[i].joint);
    EXPECT_EQ(a.translations[i].values, b.translations[i].values);
  }
}

TEST(LegPose, what_was_posed_can_be_put_back_whole_or_seen_in_part) {
  Clip walking = make_walk().clip;
  Clip standing = walking;
  const Feet feet = require_feet(walking);
  std::erase_if(standing.translations, [&](const auto& track) { return track.joint == feet.root; });
  for (const Clip& original : {walking, standing}) {
    Clip clip = original;
    const LegTracks before(clip, feet);
    pose_legs(clip, feet, lifted(foot_tracks(clip, feet), 4));
    ASSERT_NE(clip.rotations, original.rotations);
    expect_equal(before.slice_before(clip, 5, 20), slice(original, 5, 20));
    before.put_back(clip);
    expect_equal(clip, original);
  }
}

}  // namespace
}  // namespace kinespace
