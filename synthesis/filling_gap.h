// Gaps of a clip: finding them, and the plain way to fill them.
#pragma once

#include <vector>

#include "kinespace/motion/clip.h"

namespace kinespace {

struct FrameRange {
  int first_frame = 0;
  int last_frame = 0;  // included
  [[nodiscard]] int count() const { return last_frame - first_frame + 1; }
  bool operator==(const FrameRange&) const = default;
};

// Stretches that look like missing frames, in order:
//   - frames with a number that is not finite;
//   - `least` or more frames in a row in which every joint is exactly as in the frame before them (a recorder that lost
//     sight holds the last frame): these frames, not the one they repeat;
//   - `least` or more frames in a row with every rotation zero and the travel root at zero or at its rest offset.
// A clip that never moves has none. least: 1 or more.
[[nodiscard]] std::vector<FrameRange> missing_frames(const Clip& clip, int least = 3);

// The gap filled from the frames at its edges: translations linearly, rotations by slerp. Both edges must exist.
[[nodiscard]] Clip interpolate_gap(Clip clip, FrameRange gap);

// Throws Error{bad_input} unless the gaps ascend, have seen frames on both sides, and all that is seen is finite.
void require_fillable(const Clip& clip, const std::vector<FrameRange>& gaps);

}  // namespace kinespace
