// How much feet skate, sink and were moved: the figures of `compare`, `clean` and the bench.
#pragma once

#include <array>
#include <optional>

#include "kinespace/footskate/contacts.h"

namespace kinespace {

// The mean horizontal speed, cm/s, of the joints of feet while they are planted: over all steps from a frame to the
// next within a contact. nullopt where nothing stands for as long as a step: then nothing is known of what slides. The
// contacts may have been found on another clip of the same frames.
[[nodiscard]] std::optional<double> foot_slide_cm_s(const FootTracks& tracks, const FootContacts& contacts);

// The level that feet are measured against: the ground, and how high over it each joint of a foot is while it stands
// (standing_heights), by FootTracks::at.
struct FootLevel {
  Ground ground;
  std::array<double, 4> standing_cm{};
};

[[nodiscard]] FootLevel foot_level(const FootTracks& tracks);

// How feet move by the geometry of a motion alone: no contact that anyone found or planned is looked at, so that the
// same can be said of a result and of its sources.
struct FootMotion {
  // The mean horizontal speed, cm/s, of joints of feet from a frame to the next, over the steps that are low (both
  // frames at most 2.5 cm above the joint's standing height, of ankles 4 cm) and slow (less than 20 cm/s). nullopt:
  // there is no such step.
  std::optional<double> slide_cm_s;
  // The mean horizontal speed, cm/s, of the joint that is lowest over its standing height, over all steps; nullopt for
  // a single frame.
  std::optional<double> lowest_speed_cm_s;
  double penetration_cm = 0;  // of the deepest joint under the ground, >= 0
  double hover_cm = 0;        // the mean height of the lowest joint over where it stands while the hips do not fall
};

// Of the frames [first, last], both included. On uneven ground, whose levels are not known, only what stands on the
// lowest is low.
[[nodiscard]] FootMotion foot_motion(const FootTracks& tracks, const FootLevel& level, int first, int last);
[[nodiscard]] FootMotion foot_motion(const FootTracks& tracks, const FootLevel& level);

// How far the deepest joint of a foot is under the ground, cm, >= 0; of uneven ground under its lowest level.
[[nodiscard]] double floor_penetration_cm(const FootTracks& tracks, const Ground& ground);

// The mean distance, cm, over joints and frames of where the joints are against the travel root, turned with it.
// Both clips have the same skeleton and frames.
[[nodiscard]] double mean_pose_change_cm(const Clip& before, const Clip& after);

// The largest distance, cm, of any joint between two clips of the same skeleton and frames.
[[nodiscard]] double largest_move_cm(const Clip& before, const Clip& after);

// The largest acceleration of any joint, cm/s^2, by second differences; 0 for less than three frames.
[[nodiscard]] double largest_acceleration_cm_s2(const Clip& clip);

// What `compare A B` says of feet: the ground and the contacts are those of A, the joints those of B, found by name.
struct SkateFigures {
  std::optional<double> foot_slide_cm_s;  // nullopt: A has no planted foot
  double floor_penetration_cm = 0;
  FootMotion of_a, of_b;  // over the ground and by the standing heights of A
};

// nullopt when either has no feet that can be told, or the frames differ.
[[nodiscard]] std::optional<SkateFigures> compare_skate(const Clip& a, const Clip& b);

}  // namespace kinespace
