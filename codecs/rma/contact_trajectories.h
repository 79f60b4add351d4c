// Where joints touch the ground, kept apart from the postures (lin2011, section 5.3, figure 11): what a smoothed
// posture loses first is that a foot stands still.
//
// The floor is found from the data: the heights of a joint that lie together at the bottom are its lowest cluster, the
// mean of it the height at which it rests; the lowest of these is the floor, and joints that rest at most 15 cm above
// it can touch the ground. Such a joint is in contact while it is near the height where it rests (the paper's rule),
// and while it is slow at any height (on steps, bars and slopes). When it moves by more than 2.5 cm between two frames
// a new contact begins.
//
// A contact is kept as whole steps: at its first frame the difference to where the decoded posture has the joint (8
// bits of 1 mm), then from frame to frame how it moved (4 bits of 2.5 cm / 8, against what the decoder has, so that
// nothing piles up). The decoder takes the stairs off by a mean over 60 ms.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "kinespace/entropy/integer_coder.h"
#include "kinespace/motion/clip.h"

namespace kinespace {

struct ContactOptions {
  double near_cm = 3;        // off the height where it rests, up to which a joint touches the ground, >= 0
  double slow_cm_s = 20;     // up to which speed (over 80 ms) it does so at any height, >= 0; 0: only a joint at rest
  double move_cm = 2.5;      // farthest that a contact moves between two frames, > 0
  double shortest_s = 0.1;   // of a contact, >= 0
  double still_cm = 0.3125;  // a move is coded once the joint is off by more than this, >= 0; half a step: each nearest
  void validate() const;     // throws Error{usage} naming field, value and range
};

// Frames [first, first + points) of one joint.
struct ContactTrack {
  int joint = 0;
  int first = 0;
  std::vector<Eigen::Vector3d> points;  // cm, world
};

// The contacts of a clip by joint, then by time.
[[nodiscard]] std::vector<ContactTrack> find_contacts(const Clip& clip, const ContactOptions& options = {});

// A contact in whole steps.
struct ContactCode {
  static constexpr double start_step_cm = 0.1;
  static constexpr double move_step_cm = 2.5 / 8;
  static constexpr int farthest_start = 127;
  // A contact begins where the decoded joint is not farther off: a limb that was pulled further would jerk.
  static constexpr double farthest_off_cm = 6;
  static constexpr int farthest_move = 7;

  int joint = 0;
  int first = 0;
  std::array<std::int8_t, 3> start{};
  std::vector<std::array<std::int8_t, 3>> moves;  // of every later frame

  [[nodiscard]] int frames() const { return static_cast<int>(moves.size()) + 1; }
};

// `decoded`: the clip as the decoder has it before contacts.
[[nodiscard]] std::vector<ContactCode> code_contacts(std::span<const ContactTrack> tracks, const Clip& decoded,
                                                     const ContactOptions& options = {});
[[nodiscard]] std::vector<ContactTrack> contact_tracks(std::span<const ContactCode> codes, const Clip& decoded);

// Contexts that these take of a ValueWriter, from 0 on.
inline constexpr int contact_contexts = 24;
void put_contacts(ValueWriter& out, std::span<const ContactCode> codes);
// `frames` and `joints`: of the clip. Takes what it holds off `numbers`, and throws when that is not enough.
[[nodiscard]] std::vector<ContactCode> get_contacts(ValueReader& in, int frames, int joints, std::int64_t& numbers);

// The world positions of a joint, cm, in frames [first, first + count).
[[nodiscard]] std::vector<Eigen::Vector3d> joint_path(const Clip& clip, int joint, int first, int count);

}  // namespace kinespace
