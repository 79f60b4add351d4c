// Whether a stretch of cycles is better cut into whole cycles or at rests, as all other motion is.
//
// Whole cycles pay where neighbouring cycles are alike. Where they are not (punches, one after the other) functions over
// several of them are worse than those over the second around each rest. So both are tried against the functions of the
// space, and the one is taken that leaves less at equal cost: at levels of detail 5 and 12
//
//   D N^4,     D = sum over the sequences of the integral of sum_c w_c^2 (f_c - f_c at that level)^2,    N numbers a curve
//
// (twice the numbers leave about a quarter of the error, so a sixteenth of its square); the weights w_c are those of
// fpca/alignment.h.
#pragma once

#include <vector>

#include "kinespace/fpca/encoding.h"
#include "kinespace/fpca/registered_space.h"
#include "kinespace/fpca/sequences.h"

namespace kinespace {

// For each stretch of cycles of the runs, in order (Run::at_rests): whether it is to be cut at rests.
using RestChoice = std::vector<char>;

// `values`: of all frames, on the space's side. Stretches with sequences that the space has no functions for are cut at
// rests.
[[nodiscard]] RestChoice choose_rests(const RegisteredSpace& space, const SampleMatrix& values,
                                      const std::vector<Run>& runs, double rate_hz, const Compute& compute = {});

// The runs as they were chosen; nothing is left to choose.
[[nodiscard]] std::vector<Run> apply_choice(const std::vector<Run>& runs, const RestChoice& at_rests);

// Both ways at once: the runs, and every stretch once more as a run that is cut at rests. Its frames are in two.
[[nodiscard]] std::vector<Run> both_ways(const std::vector<Run>& runs);

}  // namespace kinespace
