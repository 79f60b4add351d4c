// Where a clip repeats itself, cycle after cycle (walking, running, waving), and its whole cycles.
//
// At 30 Hz keyframes t with the features x of pose_features.h (yoo2019, section 5.2, eq. 12), two neighbouring
// stretches of L keys are compared:
//
//   r(t, L) = (mean_{u in [t, t + L)} |x(u) - x(u + L)|^2 + e) / (2 var + e)
//
// where var is the total variance of x over both, [t, t + 2 L), and e = 1e-6 (about a millimetre of movement in all):
// neither noise nor perfect rest looks cyclic. r is near 0 where a cycle of L keys is repeated and about 1 where the
// two have nothing in common. Where the frames end, 0.8 L keys of the second stretch are enough.
//
// The cheapest path along the keys, through lengths L and "not cyclic", is taken (Viterbi). A key costs
// r + 0.1 L / longest_s (a cycle is meant, not its multiples), or most_difference where it is not cyclic. The length
// may change by up to 2 keys from one key to the next, at 0.05 a key; to become cyclic, or to cease to be, costs 0.5. A
// stretch whose keys save less than that against "not cyclic" is none.
//
// A parabola through r at L - 1, L, L + 1 refines L to T below a key, and r to its bottom. T(t) is the length of a
// cycle in the middle of the two that were compared, at t + T(t). It is constant beyond the first and the last of these
// and smoothed over 9 keys. The integral of 1 / T is the phase, 0 at the start of the stretch; marks lie where it is
// whole.
#pragma once

#include <vector>

#include "kinespace/motion/curves.h"

namespace kinespace {

struct CycleOptions {
  double shortest_s = 0.3;       // > 0; of a cycle. Two keys at least are taken
  double longest_s = 2.5;        // > shortest_s, at most 60; time and memory grow with it
  double most_difference = 0.3;  // (0, 1]; of neighbouring cycles (r above); unlike stretches differ by 1

  // Throws Error{usage} naming the field, its value and the legal range.
  void validate() const;
};

// Neighbouring whole cycles: cycle i lasts from marks[i] to marks[i + 1]. marks are frames of the clip, ascending, two
// at least: a stretch of little less than two cycles has a single whole one.
struct CyclicStretch {
  std::vector<int> marks;
  int end = 0;            // the last frame that is still cyclic: marks.back() or less than a cycle later
  double difference = 0;  // mean of r along the stretch

  [[nodiscard]] int cycles() const { return static_cast<int>(marks.size()) - 1; }
};

// The stretches among the frames [first, last] of a clip, both included; ascending, no frame in two: one that would
// reach into the next ends before it. Where its first cycle begins says nothing of the pose: it is where the stretch
// begins. Time is linear in the frames; memory too, at some 20 bytes a key, besides a few MB.
[[nodiscard]] std::vector<CyclicStretch> find_cycles(const ClipCurves& curves, const Skeleton& skeleton, int first,
                                                     int last, const CycleOptions& options = {});

}  // namespace kinespace
