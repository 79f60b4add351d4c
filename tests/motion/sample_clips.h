// Clips made up for the tests of motion/, and what they share.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "kinespace/base/error.h"
#include "kinespace/motion/clip.h"

namespace kinespace::test {

// A branched skeleton of 7 joints: a root with 6 channels, every kind of joint below it (all orders of three rotations,
// two rotations, one, none, six channels), end sites on its leaves.
[[nodiscard]] Skeleton branched_skeleton();

// Smooth random motion of that skeleton, within what its channels can express; the root and the joint with positions
// travel.
[[nodiscard]] Clip random_clip(std::uint32_t seed, int frames);

// The largest distance in cm between world positions of joints of the same index; fails the test when the shapes
// differ.
[[nodiscard]] double largest_distance(const Clip& a, const Clip& b);
// The same for joints of the same name; joint 0 with joint 0, joints of `b` alone do not count.
[[nodiscard]] double largest_distance_by_name(const Clip& a, const Clip& b);

// Numbers of the clip that are not finite, quaternions that are not of unit length, tracks of wrong size: "" when all
// is well.
[[nodiscard]] std::string what_is_wrong_with(const Clip& clip);

// What `parse` throws; a clip instead of an error fails the test.
[[nodiscard]] ErrorDetails error_of(const std::function<void()>& parse);

// The text with `from`, which must be in it, replaced by `to`.
[[nodiscard]] std::string replaced(std::string_view text, std::string_view from, std::string_view to);

// The text with its line `number` (from 1) replaced; "" leaves the line out.
[[nodiscard]] std::string with_line(std::string_view text, int number, std::string_view line);

inline constexpr std::string_view small_bvh = R"(HIERARCHY
ROOT Hips
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Left Leg
  {
    OFFSET 10 -5 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Foot
    {
      OFFSET 0 -40 0
      CHANNELS 1 Xrotation
      End Site
      {
        OFFSET 0 0 15
      }
    }
  }
  JOINT Head
  {
    OFFSET 0 60 0
    CHANNELS 0
    End Site
    {
      OFFSET 0 20 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.0333333
0 90 0 0 0 0 10 20 30 5
1 91 0.5 0 0 90 -10 20.25 1e1 -5.5
2 92 -1 90 0 0 .5 -2.E+0 -170 7
)";

inline constexpr std::string_view small_asf = R"(# a comment
:version 1.10
:name test
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
  begin end dof direction mean nothing here
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name hip
    direction 0.6 -0.8 0
    length 2.5
    axis 0 0 0 XYZ
  end
  begin
    id 2
    name femur
    direction 0 -1 0
    length 7
    axis 10 20 30 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
    id 3
    name tibia
    direction 0 -1 0
    length 7.5
    axis 0 0 20 XYZ
    dof rx
    limits (-10.0 170.0)
  end
:hierarchy
  begin
    root hip
    hip femur
    femur tibia
  end
)";

inline constexpr std::string_view small_amc = R"(#!OML:ASF somewhere
:FULLY-SPECIFIED
:DEGREES
1
root 1 18 -2 10 20 30
femur 5 -6 7.5
tibia 25
2
root 1.5 18 -2 11 21 31
tibia 26
femur 5 -6 8
)";

}  // namespace kinespace::test
