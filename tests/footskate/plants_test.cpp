// One place a plant, and what is carried over between plants.
#include <gtest/gtest.h>

#include "tests/footskate/skating.h"

namespace kinespace {
namespace {

using Eigen::Vector3d;

TEST(Plants, of_a_clean_clip_are_where_the_joints_stand) {
  const SampleMotion walk = make_walk();
  const Feet feet = require_feet(walk.clip);
  const FootTracks tracks = foot_tracks(walk.clip, feet);
  for (const Plant& plant : place_plants(tracks, Ground{}, contacts_of(walk, feet))) {
    EXPECT_LT((plant.place - tracks.at[plant.contact.slot][plant.contact.first_frame]).norm(), 1e-6);
  }
}

TEST(Plants, of_a_skating_foot_are_in_the_middle_of_its_way_and_as_far_apart_as_the_foot_is_long) {
  const SampleMotion walk = make_walk({.duration_s = 4});
  const Clip clip = test::with_path_scaled(walk.clip, 1.15);
  const Feet feet = require_feet(clip);
  const FootTracks tracks = foot_tracks(clip, feet);
  const std::vector<Plant> plants = place_plants(tracks, Ground{}, contacts_of(walk, feet));
  for (const Plant& p : plants) {
    if (p.contact.slot % 2 == 0) continue;
    Vector3d mean = Vector3d::Zero();
    for (int f = p.contact.first_frame; f <= p.contact.last_frame; ++f) mean += tracks.at[p.contact.slot][f];
    mean /= p.contact.last_frame - p.contact.first_frame + 1;
    EXPECT_LT((p.place - mean).norm(), 0.2);
    for (const Plant& q : plants) {
      const bool same_step = q.contact.slot == p.contact.slot - 1 && q.contact.first_frame <= p.contact.last_frame &&
                             p.contact.first_frame <= q.contact.last_frame;
      if (same_step) {
        EXPECT_NEAR((p.place - q.place).norm(), std::hypot(0.039, 0.075) * 175, 1e-6);
      }
    }
  }
}

TEST(Plants, are_set_on_the_ground_when_they_are_near_it) {
  const SampleMotion walk = make_walk();
  const Feet feet = require_feet(walk.clip);
  const FootTracks tracks = foot_tracks(walk.clip, feet);
  for (const Plant& plant : place_plants(tracks, Ground{.height_cm = 1.5}, contacts_of(walk, feet))) {
    if (plant.contact.slot % 2 == 1) {
      EXPECT_NEAR(plant.place.y(), 1.5, 1e-9);
    }
  }
  for (const Plant& plant : place_plants(tracks, Ground{.height_cm = -30}, contacts_of(walk, feet))) {
    if (plant.contact.slot % 2 == 1) {  // another level: left alone
      EXPECT_NEAR(plant.place.y(), 0, 1e-6);
    }
  }
}

TEST(JoinBetween, meets_what_is_known_with_its_speed_and_eases_to_zero_at_the_ends) {
  constexpr int frames = 400;
  std::vector<char> known(frames, 0);
  std::vector<Vector3d> values(frames, Vector3d::Zero());
  for (const auto& [first, last] : std::vector<std::pair<int, int>>{{100, 130}, {200, 240}}) {
    for (int f = first; f <= last; ++f) {
      known[f] = 1;
      values[f] = Vector3d(3 + 0.02 * f, 0, -0.05 * f);
    }
  }
  const std::vector<Vector3d> given = values;
  join_between(known, 120, values);
  for (int f = 0; f < frames; ++f) {
    if (known[f] != 0) {
      EXPECT_EQ(values[f], given[f]);
    }
  }
  double largest = 0;
  for (int f = 1; f + 1 < frames; ++f)
    largest = std::max(largest, (values[f + 1] - 2 * values[f] + values[f - 1]).norm());
  EXPECT_LT(largest, 0.05);  // a step between the two would be 5
  EXPECT_EQ(values.front(), Vector3d::Zero());
  EXPECT_EQ(values.back(), Vector3d::Zero());
}

TEST(JoinBetween, changes_nothing_when_all_or_nothing_is_known) {
  std::vector<Vector3d> values(50, Vector3d(1, 2, 3));
  join_between(std::vector<char>(50, 1), 60, values);
  EXPECT_EQ(values, std::vector<Vector3d>(50, Vector3d(1, 2, 3)));
  std::vector<Vector3d> zeros(50, Vector3d::Zero());
  join_between(std::vector<char>(50, 0), 60, zeros);
  EXPECT_EQ(zeros, std::vector<Vector3d>(50, Vector3d::Zero()));
}

}  // namespace
}  // namespace kinespace
