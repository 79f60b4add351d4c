// How a clip is registered: where it is cut into sequences (yoo2019, sections 5.2 and 7.2).
//
// Where motion is cyclic it is cut into whole cycles (fpca/cycles.h), one to `most_cycles` a sequence: a warp with fixed
// ends cannot take out a difference of phase, and functions over whole cycles are fewer than those over windows of any
// other length. Each stretch begins with a cycle; what is left of it after its last whole cycle, and all other motion,
// is cut at rests: at frames where the body moves and jerks least, 0.8 to 1.2 s apart. Over all cuts there
//
//   sum  rest(frame) + length_weight * (0.4 x + 0.6 x^2),   x = (length - shortest) / (longest - shortest)
//
// is least (dynamic programming), where rest is the mean squared joint speed over its mean, plus jerk_weight times the
// squared largest change of joint speed over its 95th percentile. Shorter sequences need fewer functions, so length
// costs. Neighbours share the cut frame.
//
// Real recordings have breaks: one frame to the next, a joint is somewhere else. No smooth function can follow that, so
// a clip is parted there into runs, and the sequences on both sides share no frame.
#pragma once

#include <cstdint>
#include <vector>

#include "kinespace/fpca/cycles.h"
#include "kinespace/motion/clip.h"
#include "kinespace/motion/curves.h"

namespace kinespace {

struct SequenceOptions {
  int most_cycles = 3;  // of a sequence, 0 .. 8; 0: all motion is cut at rests
  bool equal_windows =
      false;                 // as many sequences, but of equal length, at any phase: what registration is held against
  double shortest_s = 0.8;   // > 0; a sequence of n frames lasts n / rate
  double longest_s = 1.2;    // > shortest_s
  double length_weight = 5;  // >= 0; how much a sequence of the longest length costs against a cut amid motion
  double jerk_weight = 3;    // >= 0
  double break_cm = 10;      // > 0; a joint that moves farther than this in one frame ...
  double break_ratio = 4;    // > 1; ... and this much farther than in the two frames before and after is a break
  CycleOptions cycles;

  // Throws Error{usage} naming the field, its value and the legal range.
  void validate() const;
};

// A stretch without breaks. cuts are frames of the clip, ascending: the first frame of the run, the cuts, the last
// frame; a run of a single frame has that frame alone. Sequence i goes from cuts[i] to cuts[i + 1], both included.
struct Run {
  std::vector<int> cuts;
  std::vector<std::uint8_t> cycles{};  // that each sequence holds, 0 where it was cut at rests; empty: all 0

  // The other way to cut a stretch of cycles, sequences [sequence, sequence + count): at rests, between the same ends.
  struct Alternative {
    int sequence = 0;
    int count = 0;
    std::vector<int> cuts;
  };
  std::vector<Alternative> at_rests{};  // ascending, one for each stretch of cycles

  [[nodiscard]] int sequence_count() const { return cuts.size() == 1 ? 1 : static_cast<int>(cuts.size()) - 1; }
  [[nodiscard]] int first_frame(int sequence) const { return cuts[static_cast<std::size_t>(sequence)]; }
  [[nodiscard]] int last_frame(int sequence) const {
    return cuts.size() == 1 ? cuts[0] : cuts[static_cast<std::size_t>(sequence) + 1];
  }
  [[nodiscard]] int cycles_of(int sequence) const {
    return cycles.empty() ? 0 : cycles[static_cast<std::size_t>(sequence)];
  }
};

// Runs of one clip, ascending; together they hold every frame once, but for cuts that two sequences share. A run
// shorter than longest_s without a whole cycle is one sequence. Time and memory are linear in the frames.
[[nodiscard]] std::vector<Run> cut_sequences(const Clip& clip, const SequenceOptions& options = {});

// The same in two steps, for a clip that becomes its curves in between (clip_curves).
class SequenceCutter {
 public:
  // What cuts at rests and breaks are chosen by, frame by frame.
  struct Movement {
    std::vector<double> mean_square_speed;  // (cm/s)^2, mean over joints
    std::vector<double> speed_change;       // cm/s, largest over joints
    std::vector<int> breaks;                // frames after which the body is elsewhere
  };

  SequenceCutter(const Clip& clip, const SequenceOptions& options);
  [[nodiscard]] std::vector<Run> cut(const ClipCurves& curves, const Skeleton& skeleton) const;

 private:
  SequenceOptions options_;
  Movement movement_;
};

}  // namespace kinespace
