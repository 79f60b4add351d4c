// How far the joints of each level of detail are from those of the clip as it was read, and how much more detail fast
// motion takes.
//
// Functions are chosen for all motion, so the first few of them follow a blow or a leap less well than a walk: where a
// hand moves 10 cm a frame they may be half a metre off. So a level n of detail is to leave no joint more than
//
//   e(n) = 11.5 cm (5 / n)^(5/4)              (21.8 cm at 3, 11.5 at 5, 4.8 at 10)
//
// off, and a sequence that errs more takes more numbers: at level n of the clip those of level (1 + x / 16) n, with the
// least x (EncodedSequence::extra_detail, up to 240) that serves all measured levels up to 10. Few sequences need any.
#pragma once

#include <vector>

#include "kinespace/fpca/encoding.h"

namespace kinespace {

// e(n), cm.
[[nodiscard]] double largest_error_meant(int level);

// The levels that are measured: all that are ever played by themselves, and fewer and fewer beyond, to the last.
[[nodiscard]] std::vector<int> measured_levels(int levels);

// Gives the sequences of a clip their detail, and fills in its errors (EncodedClip::levels, error). `original`: the
// curves that it was encoded from, on the space's side.
void measure_levels(const ClipDecoder& decoder, const ClipCurves& original, const Skeleton& skeleton, int levels,
                    EncodedClip& clip);

}  // namespace kinespace
