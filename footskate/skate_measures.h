// How much feet skate, sink and were moved: the figures of `compare`, `clean` and the bench.
#pragma once

#include <optional>

#include "kinespace/footskate/contacts.h"

namespace kinespace {

// The mean horizontal speed, cm/s, of the joints of feet while they are planted: over all steps from a frame to the
// next within a contact. nullopt where nothing stands for as long as a step: then nothing is known of what slides. The
// contacts may have been found on another clip of the same frames.
[[nodiscard]] std::optional<double> foot_slide_cm_s(const FootTracks& tracks, const FootContacts& contacts);

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
};

// nullopt when either has no feet that can be told, or the frames differ.
[[nodiscard]] std::optional<SkateFigures> compare_skate(const Clip& a, const Clip& b);

}  // namespace kinespace
