// The last of a jerk where clips of an approximated motion meet, taken out of the decoded joints (beyond lin2011).
//
// The paper smooths markers (seams.h), before rotations are found and contacts held; where the two sides are far apart,
// a limb may still turn over within a frame. So joints are looked at as they come out: where the speed of any changes
// by more at a seam than a limit of the stream, local rotations and the root's travel around it become
//
//   x' = argmin  sum_f u_f^2 (x'_f - x_f)^2 + lambda sum_f (x'_{f-1} - 2 x'_f + x'_{f+1})^2
//
// with u_f the distance to the seam over the reach. Reach (0.1 s, then 0.2, 0.4 s; at most twice the way to the seams
// around) and lambda (1 to 4096) are the first that keep to the limit. The limit is such that jerks of its size are
// seen elsewhere in the same motion, too. Products, sums and square roots in a fixed order: the same bits on every
// machine.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/motion/clip.h"

namespace kinespace {

inline constexpr int most_seam_limit = 1'000'000;  // cm/s

// The largest change of a joint's speed at a seam, cm/s from one frame to the next: at the frames on its both sides.
// `seam`: the first frame of the later clip, 1 to frames - 1.
[[nodiscard]] double speed_change_at_seam(const Clip& clip, int seam);

// Eases every seam above the limit, in rising order. `breaks`: first frames that do not go on from those before them;
// nothing reaches across. A limit of 0: none is eased.
void ease_seams(Clip& clip, std::span<const int> seams, double limit_cm_s, std::span<const int> breaks = {});

struct ClipSeams {
  std::vector<int> seams;
  std::vector<int> breaks;
};

// What an encoder does: clips as decoded before easing, a limit from the changes away from their seams, the error after
// easing.
struct EasedError {
  int limit_cm_s = 0;
  ClipErrorSums error;
};
// `decode(c)`: clip c before easing; called again for clips that are eased.
[[nodiscard]] EasedError measure_eased(std::span<const Clip> originals, std::span<const ClipSeams> seams,
                                       const std::function<Clip(std::size_t)>& decode, const Progress& progress);

}  // namespace kinespace
