// A picture of how a clip was registered: its curves over time with the sequences that it was cut into, and one curve
// of its cycles laid over each other, before registration (equal windows, as many as there are cycles) and after it
// (whole cycles, time linear in each sequence).
#pragma once

#include <string>
#include <vector>

#include "kinespace/fpca/encoding.h"

namespace kinespace {

struct PicturedSequence {
  int first = 0;  // frames of the clip, both included
  int last = 0;
  int cycles = 0;  // 0: cut at rests
};
[[nodiscard]] std::vector<PicturedSequence> pictured(const EncodedClip& clip);
[[nodiscard]] std::vector<PicturedSequence> pictured(const std::vector<Run>& runs);

// SVG. Under both overlays stands how far the curves are from their mean (root mean square). Equal input gives equal
// text.
[[nodiscard]] std::string registration_picture_svg(const ClipCurves& curves, const Skeleton& skeleton,
                                                   const std::vector<PicturedSequence>& sequences);

}  // namespace kinespace
