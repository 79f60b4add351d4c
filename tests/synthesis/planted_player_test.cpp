#include "kinespace/synthesis/planted_player.h"

#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/fpca/space_builder.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

// Sample clips, encoded, with their feet.
struct WithFeet {
  RegisteredSpace space;
  std::vector<EncodedClip> clips;
  Skeleton skeleton;
};

const WithFeet& clips_with_feet() {
  static const WithFeet made = [] {
    std::vector<PreparedClip> clips;
    for (const SampleMotion& motion : sample_library({.takes = 1})) {
      if (clips.size() < 16) clips.push_back(prepare(motion.clip));
    }
    SpaceBuildOptions options;
    options.alignment.on_trial = false;
    BuiltSpace built = build_space(source_of(clips), options);
    WithFeet out{std::move(built.space), {}, clips.front().skeleton};
    for (std::size_t i = 0; i < clips.size(); ++i) {
      ClipCurves curves = clips[i].curves;
      out.space.apply_references(curves.values);
      out.clips.push_back(encode(out.space, curves, built.runs_of(static_cast<int>(i), clips[i].runs), built.warps[i]));
      out.clips.back().feet = keep_feet(clip_from_curves(clips[i].curves, clips[i].skeleton), curves.placement);
    }
    return out;
  }();
  return made;
}

Clip decoded(const EncodedClip& clip, int functions) {
  return clip_from_curves(decode(clips_with_feet().space, clip, functions), clips_with_feet().skeleton);
}

TEST(PlantedPlayer, few_functions_play_with_the_feet_of_the_original) {
  int judged = 0;
  double unplanted = 0;
  double planted = 0;
  for (const EncodedClip& clip : clips_with_feet().clips) {
    if (!clip.feet) continue;
    ++judged;
    Clip played = decoded(clip, 5);
    unplanted += measure_feet(played, *clip.feet, clip.placement).slide_cm_s;
    plant_feet(played, *clip.feet, clip.placement);
    const FeetMeasures after = measure_feet(played, *clip.feet, clip.placement);
    planted += after.slide_cm_s;
    EXPECT_LE(after.slide_cm_s, 1.3 * clip.feet->slide_cm_s + 0.5) << clip.name;
    EXPECT_LE(after.floor_penetration_cm, 0.5) << clip.name;
  }
  EXPECT_GT(judged, 10);
  EXPECT_LT(planted, 0.5 * unplanted);
}

TEST(PlantedPlayer, a_pose_is_that_of_the_planted_clip) {
  const WithFeet& all = clips_with_feet();
  const auto basis = std::make_shared<const PlaybackBasis>(all.space);
  const std::vector<int> joints = all.skeleton.rotating_joints();
  for (std::size_t i = 0; i < all.clips.size(); i += 3) {
    const EncodedClip& clip = all.clips[i];
    const PlantedPlayer player(Player(basis, clip), clip, all.skeleton);
    ASSERT_EQ(player.plants(), clip.feet.has_value());
    if (!player.plants()) continue;
    for (const int functions : {2, 5}) {
      Clip whole = decoded(clip, functions);
      plant_feet(whole, *clip.feet, clip.placement);
      std::vector<float> rotations(4 * joints.size());
      double largest = 0;
      for (int f = clip.frames - 1; f >= 0; f -= 3) {  // in no order that a stream has
        static_cast<void>(player.pose(f / clip.rate_hz, functions, rotations));
        for (std::size_t j = 0; j < joints.size(); ++j) {
          const float* q = rotations.data() + 4 * j;
          const Eigen::Quaterniond played(static_cast<double>(q[0]), static_cast<double>(q[1]),
                                          static_cast<double>(q[2]), static_cast<double>(q[3]));
          largest = std::max(largest, played.angularDistance(whole.rotation(joints[j], f)));
        }
      }
      // A leg that is nearly straight makes much of the last digits of a float.
      EXPECT_LT(largest, 5e-3) << clip.name << " at " << functions;
    }
  }
}

TEST(PlantedPlayer, nothing_is_planted_where_nothing_is_kept_and_at_fine_levels) {
  const WithFeet& all = clips_with_feet();
  const EncodedClip* known = nullptr;
  for (const EncodedClip& clip : all.clips) known = clip.feet ? &clip : known;
  ASSERT_NE(known, nullptr);
  EncodedClip bare = *known;
  bare.feet.reset();
  const Player player(all.space, *known);
  const PlantedPlayer of_before(player, bare, all.skeleton);
  EXPECT_FALSE(of_before.plants());
  const PlantedPlayer planting(player, *known, all.skeleton);
  std::vector<float> expected(4 * static_cast<std::size_t>(player.joints()));
  std::vector<float> played(expected.size());
  bool differs = false;
  for (double t = 0; t < player.duration_s(); t += 0.01) {
    const Eigen::Vector3f root = player.pose(t, 5, expected);
    EXPECT_EQ(of_before.pose(t, 5, played), root);
    EXPECT_EQ(played, expected);
    static_cast<void>(planting.pose(t, 5, played));
    differs = differs || played != expected;
    static_cast<void>(player.pose(t, planted_below, expected));
    static_cast<void>(planting.pose(t, planted_below, played));
    EXPECT_EQ(played, expected);
  }
  EXPECT_TRUE(differs);
}

}  // namespace
}  // namespace kinespace
