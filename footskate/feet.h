// The legs of a skeleton: which joints are hip, knee, ankle and toe.
//
// Ankles are looked for by name first ("LeftFoot", "lfoot", "Foot_L", "mixamorig:RightFoot", "l_ankle"), then by shape:
// of all mirrored pairs of chains (equal bone lengths on both sides) with two long bones, the pair whose ends stay
// lowest in the clip. Hip and knee follow from the ankle by shape: the joints above it that give the two longest bones.
// The toe joint is the ankle's child called "toe" or "ball", else its longest child; a foot may have none.
//
// What it does not do: more than two legs, wheels, tails.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "kinespace/motion/clip.h"

namespace kinespace {

struct Leg {
  int hip = -1;  // indices of joints
  int knee = -1;
  int ankle = -1;
  int toe = -1;  // the ball of the foot; -1: the foot has no joint there
};

struct Feet {
  std::array<Leg, 2> legs;   // left, right
  int root = 0;              // the joint whose travel moves all (Skeleton::travel_root)
  double leg_length_cm = 0;  // thigh + shin, the mean of both: what sizes and speeds are measured by

  // The four joints that can stand: left ankle, left toe, right ankle, right toe; -1 for a toe that is not there.
  [[nodiscard]] std::array<int, 4> foot_joints() const {
    return {legs[0].ankle, legs[0].toe, legs[1].ankle, legs[1].toe};
  }
};

// The names of both ankle joints; both or none. None: they are looked for.
struct FeetNames {
  std::string left;
  std::string right;
  [[nodiscard]] bool given() const { return !left.empty() || !right.empty(); }

  // "LEFT,RIGHT" as the command takes it. Throws Error{usage} when it is not two names.
  [[nodiscard]] static FeetNames parse(const std::string& text);
};

// The legs; nullopt when no pair of legs can be told. Throws Error{bad_input} for given names that the skeleton does
// not have or that have no leg above them.
[[nodiscard]] std::optional<Feet> find_feet(const Clip& clip, const FeetNames& names = {});

// The same, but throws Error{bad_input} that says how to name the feet.
[[nodiscard]] Feet require_feet(const Clip& clip, const FeetNames& names = {});

}  // namespace kinespace
