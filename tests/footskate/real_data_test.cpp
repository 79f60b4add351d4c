// Captured motion: walks, uneven ground, climbing.
#include <gtest/gtest.h>

#include "kinespace/motion/read.h"
#include "tests/footskate/skating.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::data_folder;

TEST(RealFeet, are_found_in_all_collections) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const auto ankles = [](const Clip& clip) {
    const Feet feet = require_feet(clip);
    std::string out;
    for (const Leg& leg : feet.legs) {
      for (const int joint : {leg.hip, leg.knee, leg.ankle, leg.toe}) out += clip.skeleton.joints[joint].name + " ";
    }
    return out;
  };
  const std::string cmu = "lfemur ltibia lfoot ltoes rfemur rtibia rfoot rtoes ";
  for (const char* file : {"01/01_05.amc", "02/02_01.amc", "03/03_01.amc"}) {
    EXPECT_EQ(ankles(read_clip(data / "cmu" / file)), cmu) << file;
  }
  EXPECT_EQ(ankles(read_clip(data / "bandai1" / "walk_normal_001.bvh")),
            "UpperLeg_L LowerLeg_L Foot_L Toes_L UpperLeg_R LowerLeg_R Foot_R Toes_R ");
}

TEST(RealCleanup, of_walks_takes_the_skate_out) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  for (const char* file : {"cmu/02/02_01.amc", "cmu/02/02_02.amc", "bandai1/walk_normal_001.bvh"}) {
    const Clip clip = read_clip(data / file);
    const CleanResult result = clean(clip);
    EXPECT_GT(result.report.foot_slide_before_cm_s, 1) << file;
    EXPECT_LT(result.report.foot_slide_after_cm_s, 0.05 * result.report.foot_slide_before_cm_s.value()) << file;
    EXPECT_LT(result.report.floor_penetration_cm, 0.05) << file;
    EXPECT_LT(result.report.mean_pose_change_cm, 1) << file;
    EXPECT_LT(result.report.acceleration_ratio, 1.2) << file;
    EXPECT_LE(largest_move_cm(result.clip, clean(result.clip).clip), 0.1) << file;
  }
}

// Frames in which a foot is far above everything the other foot or itself ever stood on are in mid-air.
TEST(RealCleanup, plants_no_foot_in_mid_air) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  for (const char* file : {"cmu/01/01_01.amc", "cmu/03/03_01.amc"}) {
    const Clip clip = read_clip(data / file);
    const CleanResult result = clean(clip);
    const FootTracks tracks = foot_tracks(clip, result.report.feet);
    ASSERT_FALSE(result.report.plants.empty());
    for (const Plant& plant : result.report.plants) {
      // Within a plant the captured joint is slow and level.
      const Path& path = tracks.at[plant.contact.slot];
      double low = path[plant.contact.first_frame].y();
      double high = low;
      for (int f = plant.contact.first_frame; f <= plant.contact.last_frame; ++f) {
        low = std::min(low, path[f].y());
        high = std::max(high, path[f].y());
      }
      EXPECT_LT(high - low, 0.1 * result.report.feet.leg_length_cm) << file;
    }
  }
}

TEST(RealCleanup, of_uneven_ground_says_so_and_pulls_no_foot_through_it) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const CleanResult result = clean(read_clip(data / "cmu/03/03_01.amc"));
  EXPECT_EQ(result.report.ground.kind, GroundKind::uneven);
  EXPECT_LT(result.report.floor_penetration_cm, 1);
  EXPECT_LT(result.report.mean_pose_change_cm, 1);
}

}  // namespace
}  // namespace kinespace
