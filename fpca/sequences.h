// Where long clips are cut into sequences of about a second (yoo2019, section 7.2: 0.8 to 1.2 s).
//
// Cuts lie at frames where the body moves and jerks least; neighbours share the cut frame. Over all cuts
//
//   sum  rest(frame) + length_weight * (0.4 x + 0.6 x^2),   x = (length - shortest) / (longest - shortest)
//
// is least (dynamic programming), where rest is the mean squared joint speed over its mean, plus jerk_weight times the
// squared largest change of joint speed over its 95th percentile. Shorter sequences need fewer functions, so length
// costs.
//
// Real recordings have breaks: one frame to the next, a joint is somewhere else. No smooth function can follow that, so
// a clip is parted there into runs, and the sequences on both sides share no frame.
#pragma once

#include <vector>

#include "kinespace/motion/clip.h"

namespace kinespace {

struct SequenceOptions {
  double shortest_s = 0.8;   // > 0; a sequence of n frames lasts n / rate
  double longest_s = 1.2;    // > shortest_s
  double length_weight = 5;  // >= 0; how much a sequence of the longest length costs against a cut amid motion
  double jerk_weight = 3;    // >= 0
  double break_cm = 10;      // > 0; a joint that moves farther than this in one frame ...
  double break_ratio = 4;    // > 1; ... and this much farther than in the two frames before and after is a break

  // Throws Error{usage} naming the field, its value and the legal range.
  void validate() const;
};

// A stretch without breaks. cuts are frames of the clip, ascending: the first frame of the run, the cuts, the last
// frame; a run of a single frame has that frame alone. Sequence i goes from cuts[i] to cuts[i + 1], both included.
struct Run {
  std::vector<int> cuts;

  [[nodiscard]] int sequence_count() const { return cuts.size() == 1 ? 1 : static_cast<int>(cuts.size()) - 1; }
  [[nodiscard]] int first_frame(int sequence) const { return cuts[static_cast<std::size_t>(sequence)]; }
  [[nodiscard]] int last_frame(int sequence) const {
    return cuts.size() == 1 ? cuts[0] : cuts[static_cast<std::size_t>(sequence) + 1];
  }
};

// Runs of one clip, ascending; together they hold every frame once, but for cuts that two sequences share. A run
// shorter than longest_s is one sequence. Time and memory are linear in the frames.
[[nodiscard]] std::vector<Run> cut_sequences(const Clip& clip, const SequenceOptions& options = {});

}  // namespace kinespace
