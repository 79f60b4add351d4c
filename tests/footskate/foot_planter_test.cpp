#include "kinespace/footskate/foot_planter.h"

#include <cmath>

#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/footskate/skate_measures.h"
#include "kinespace/motion/curves.h"

namespace kinespace {
namespace {

// What few functions do to a motion: root and legs sway slowly about what they were.
Clip swayed(Clip clip, double degrees) {
  const Feet feet = require_feet(clip);
  const double angle = degrees * 3.14159265358979 / 180;
  for (int f = 0; f < clip.frames; ++f) {
    const double t = f / clip.rate_hz;
    for (std::size_t side = 0; side < 2; ++side) {
      const auto sway = [&](int joint, double frequency, const Eigen::Vector3d& axis) {
        const double by = angle * std::sin(frequency * t + static_cast<double>(side));
        clip.set_rotation(joint, f, clip.rotation(joint, f) * Eigen::Quaterniond(Eigen::AngleAxisd(by, axis)));
      };
      sway(feet.legs[side].hip, 6, Eigen::Vector3d::UnitX());
      sway(feet.legs[side].knee, 7, Eigen::Vector3d::UnitX());
      sway(feet.legs[side].ankle, 9, Eigen::Vector3d::UnitZ());
    }
  }
  for (std::size_t f = 0; f < static_cast<std::size_t>(clip.frames); ++f) {
    clip.require_translation_track(feet.root).values[f].y() -= 1 + std::sin(5 * static_cast<double>(f) / clip.rate_hz);
  }
  return clip;
}

struct Planted {
  Clip original, before, after;
  KeptFeet feet;
  Placement placement;
};

Planted planted(const SampleMotion& motion, double degrees) {
  Planted out{
      .original = motion.clip, .before = swayed(motion.clip, degrees), .after = {}, .feet = {}, .placement = {}};
  out.placement = clip_curves(motion.clip).placement;
  out.feet = keep_feet(motion.clip, out.placement).value();
  out.after = out.before;
  plant_feet(out.after, out.feet, out.placement);
  return out;
}

// The largest change of where a foot is against the original, from one frame to the next.
double largest_pop_cm(const Clip& original, const Clip& other) {
  const Feet feet = require_feet(original);
  const FootTracks a = foot_tracks(original, feet);
  const FootTracks b = foot_tracks(other, feet);
  double largest = 0;
  for (std::size_t slot = 0; slot < 4; ++slot) {
    for (std::size_t f = 1; f < static_cast<std::size_t>(a.frames); ++f) {
      const Eigen::Vector3d now = b.at[slot][f] - a.at[slot][f];
      const Eigen::Vector3d before = b.at[slot][f - 1] - a.at[slot][f - 1];
      largest = std::max(largest, (now - before).norm());
    }
  }
  return largest;
}

TEST(FootPlanter, feet_stand_where_those_of_the_original_did) {
  for (const SampleMotion& motion : {make_walk(), make_run(), make_walk({.turn_rate_deg_s = 40})}) {
    const Planted p = planted(motion, 4);
    const FeetMeasures before = measure_feet(p.before, p.feet, p.placement);
    const FeetMeasures after = measure_feet(p.after, p.feet, p.placement);
    EXPECT_GT(before.slide_cm_s, 10);
    EXPECT_LE(after.slide_cm_s, 1.3 * p.feet.slide_cm_s + 0.5);
    EXPECT_LE(after.floor_penetration_cm, 0.5);
    EXPECT_GT(before.floor_penetration_cm, 1);
    EXPECT_LT(largest_pop_cm(p.original, p.after), 1.5 * largest_pop_cm(p.original, p.before));
  }
}

TEST(FootPlanter, all_above_the_hips_keeps_its_numbers) {
  const Planted p = planted(make_walk(), 4);
  for (const char* name : {"Hips", "Spine", "Head", "LeftHand"}) {
    const int joint = p.original.skeleton.find(name);
    const auto before = p.before.rotation_track(joint);
    const auto after = p.after.rotation_track(joint);
    EXPECT_TRUE(std::ranges::equal(before, after)) << name;
  }
  EXPECT_EQ(p.before.translation_track(0)->values, p.after.translation_track(0)->values);
}

TEST(FootPlanter, feet_that_stand_already_hardly_move) {
  const Planted p = planted(make_walk(), 0);
  Clip clip = p.original;
  plant_feet(clip, p.feet, p.placement);
  const FootTracks a = foot_tracks(p.original, require_feet(clip));
  const FootTracks b = foot_tracks(clip, require_feet(clip));
  for (std::size_t slot = 0; slot < 4; ++slot) {
    for (std::size_t f = 0; f < a.at[slot].size(); ++f) EXPECT_LT((a.at[slot][f] - b.at[slot][f]).norm(), 0.3);
  }
}

}  // namespace
}  // namespace kinespace
