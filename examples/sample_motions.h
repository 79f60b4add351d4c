// Motions made from nothing: labelled walks, runs, turns, waves, raises, jumps and stands of one 22-joint body.
//
// They stand in for motion capture where none is at hand (the demo, the tests) and, unlike captured data, they come
// with the truth: what each clip is, and exactly when which foot is planted where.
//
// How they are made: footsteps are planned first (where, when, how the heel strikes and lifts); between two plants a
// foot moves on an arc that is twice continuously differentiable, with zero velocity and acceleration where it leaves
// and meets the floor. The hips follow a smooth path (bob, sway, list, lean; ballistic with g = 9.81 m/s^2 while a run
// or a jump is in the air) whose height is set so that no leg reaches further than 99.5 % of its length. Two-bone
// inverse kinematics then gives the legs; arms, spine and head follow joint angles. Gait figures (cadence, stance
// share, stride) are usual values of adults; limb proportions after Drillis and Contini (1966), as in Winter,
// "Biomechanics and Motor Control of Human Movement".
//
// What it does not do: dynamics (balance, momentum), fingers, uneven floors, objects.
//
// Units in options: metres per second, degrees, seconds, centimetres for lengths of the body. Clips are in the
// library's units (clip.h). Heading 0 faces +Z; positive headings and turns go to the left (+X), as rotations about +Y
// do. Bodies of other heights move as one of 175 cm does at the same Froude number v^2 / (g height). Every function
// gives the same clip for the same options on the same machine.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/motion/clip.h"

namespace kinespace {

enum class Side : std::uint8_t { left, right, both };

// "left", "right", "both".
[[nodiscard]] std::string_view to_string(Side side);

// The body of all sample motions, standing in T-pose on the floor y = 0 and facing +Z:
//   Hips, Spine, Spine1, Spine2, Neck, Head, and on each side (Left..., Right...)
//   Shoulder, Arm, ForeArm, Hand, UpLeg, Leg, Foot, ToeBase.
// The hips have six channels (positions, then Z X Y rotations), all others Z X Y rotations. The toe joint is the ball
// of the foot and lies on the sole: a foot stands flat when its toe joint is at y = 0 and its ankle at 3.9 % of the
// height. `height_cm` is the extent from sole to crown, 50 to 300. Throws Error{usage} outside that.
[[nodiscard]] Skeleton sample_skeleton(double height_cm = 175);

// A time a joint of a foot stands still on the floor: its world position is the same in all of these frames, to
// rounding (below 1e-9 cm). A step that rolls over the ball gives two: the ankle ("LeftFoot") while the foot is flat,
// and the toe joint ("LeftToeBase") until it leaves the floor. A heel that touches first is not a contact until the
// foot is flat, because no joint stands still then. A contact cut by the first or last frame of the clip ends there.
struct Contact {
  Side side = Side::left;  // never both
  int joint = 0;           // index of that side's Foot or ToeBase in the skeleton
  int first_frame = 0;
  int last_frame = 0;  // included; >= first_frame
  bool operator==(const Contact&) const = default;
};

struct SampleMotion {
  Clip clip;
  std::vector<std::string> labels;  // content ("walk"), then style ("fast")
  std::vector<Contact> contacts;    // by joint, then by time
};

// What every sample motion has in common.
struct TakeOptions {
  double rate_hz = 60;     // 10 to 1000
  double height_cm = 175;  // 100 to 220: the walker's
  double heading_deg = 0;  // -360 to 360: where the walker faces first
  std::uint64_t seed = 1;  // draws the small variation: another seed is another take
  double variation = 1;    // 0 to 1: how much foot placement, arm swing and posture vary; 0: none
  void validate() const;   // throws Error{usage} naming the field, its value and its range; so do all below
};

// A steady walk along a line or an arc; starts and ends in mid-stride.
struct WalkOptions {
  double speed_m_s = 1.3;                 // 0.4 to 2.2: of the hips along the path
  double turn_rate_deg_s = 0;             // -60 to 60: of the heading; radius = speed / rate
  std::optional<double> cadence_per_min;  // steps, 40 to 200; default 111 sqrt(speed / 1.3) at a height of 175 cm. The
                                          // step it gives may not exceed 0.53 of the height
  double arm_swing = 1;                   // 0 to 2: share of the usual swing
  double start_phase = 0;                 // 0 to 1: share of the stride that has passed since the left heel strike
  double duration_s = 3;                  // 0.1 to 600
  std::string style = "normal";           // the second label: 1 to 40 letters, digits and hyphens
  TakeOptions take = {};
  void validate() const;
};

// A steady run along a line or an arc, with a flight phase in every step.
struct RunOptions {
  double speed_m_s = 3;                   // 1.8 to 4.5
  double turn_rate_deg_s = 0;             // -45 to 45
  std::optional<double> cadence_per_min;  // steps, 120 to 220; default 140 + 10 * speed at a height of 175 cm. The step
                                          // it gives may not exceed 0.85 of the height
  double arm_swing = 1;                   // 0 to 2
  double start_phase = 0;                 // 0 to 1
  double duration_s = 2;                  // 0.1 to 600
  std::string style = "normal";
  TakeOptions take = {};
  void validate() const;
};

// Stands, turns on the spot by stepping round, stands.
struct TurnOptions {
  Side side = Side::left;  // left or right
  double angle_deg = 90;   // 15 to 360
  double step_s = 0.5;     // 0.35 to 1.5: of one of the steps; there are two for every 75 degrees begun
  TakeOptions take = {};
  void validate() const;
};

// Stands and waves one hand, or both, beside the head.
struct WaveOptions {
  Side side = Side::right;
  double frequency_hz = 1.6;  // 0.5 to 3: of the forearm to and fro
  int waves = 3;              // 1 to 50
  TakeOptions take = {};
  void validate() const;
};

// Stands and lifts one arm, or both, holds and lowers.
struct RaiseOptions {
  Side side = Side::both;
  double angle_deg = 165;  // 30 to 175: of the upper arm from hanging
  bool sideways = false;   // through the side rather than through the front
  double raise_s = 0.9;    // 0.4 to 5: to lift, and to lower
  double hold_s = 0.5;     // 0 to 10
  TakeOptions take = {};
  void validate() const;
};

// Stands, crouches, jumps off both feet, lands, stands. The hips fly a parabola.
struct JumpOptions {
  double rise_cm = 30;    // 10 to 60: of the hips, from leaving the floor to the top
  double distance_m = 0;  // 0 to 1.2: forwards
  TakeOptions take = {};
  void validate() const;
};

// Stands, shifting weight and looking about a little.
struct StandOptions {
  double duration_s = 3;       // 0.1 to 600
  std::string style = "calm";  // the second label
  double sway = 1;             // 0 to 2: share of the usual shifting
  TakeOptions take = {};
  void validate() const;
};

[[nodiscard]] SampleMotion make_walk(const WalkOptions& options = {});
[[nodiscard]] SampleMotion make_run(const RunOptions& options = {});
[[nodiscard]] SampleMotion make_turn(const TurnOptions& options = {});
[[nodiscard]] SampleMotion make_wave(const WaveOptions& options = {});
[[nodiscard]] SampleMotion make_raise(const RaiseOptions& options = {});
[[nodiscard]] SampleMotion make_jump(const JumpOptions& options = {});
[[nodiscard]] SampleMotion make_stand(const StandOptions& options = {});

// A labelled collection: `takes` takes each of 24 motions (walks and runs at several speeds, along lines and arcs;
// turns, waves, raises, jumps, stands). Takes differ in speed, heading, phase and variation. Clips are named
// content_style_number, e.g. "walk_fast_002", and no two names are equal.
struct LibraryOptions {
  std::uint64_t seed = 1;
  int takes = 3;           // 1 to 1000; 3 give 72 clips
  double rate_hz = 60;     // 10 to 1000
  double height_cm = 175;  // 100 to 220
  void validate() const;
};

[[nodiscard]] std::vector<SampleMotion> sample_library(const LibraryOptions& options = {});

}  // namespace kinespace
