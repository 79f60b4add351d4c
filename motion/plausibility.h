// Whether a clip can be what it is taken for: a person, in centimetres, Y up, on a floor at about 0.
//
// Motion files say neither their unit nor which way is up, and what is computed from a clip in metres or with Z up
// looks like a result. Nothing is changed here; whoever reads a clip for a user passes these doubts on.
//
// What it does not see: a body that hangs upside down, left-handed axes, a floor that tilts. A person who lies all the
// time is taken for one whose file has another axis up; skeletons of fewer than five joints are no bodies, and there is
// no doubt about them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kinespace/motion/clip.h"

namespace kinespace {

enum class DoubtKind : std::uint8_t {
  height,  // at rest less than 80 cm or more than 300 cm: another unit?
  axis,    // most of the time the body reaches farther along X or Z than 1.5 times as far as along Y: another axis up?
  floor,   // the lowest joint is never within a quarter of the body's height of 0 (looked at when Y is up)
};

struct Doubt {
  DoubtKind kind = DoubtKind::height;
  std::string text;  // one sentence, with the figures
};

// From at most 200 frames, evenly spread. At most one of a kind, in the order of the kinds.
[[nodiscard]] std::vector<Doubt> doubts_about(const Clip& clip);

// The unit in which a skeleton of this height would be a person's: "m", "inch", "cm" or "mm"; else "unknown".
[[nodiscard]] std::string guess_unit(double height);

}  // namespace kinespace
