// Repeated motion analysis (lin2011 section 4): which stretches of motion are near copies of others.
//
// The frames are cut where the behaviour changes (segmentation.h), like segments are grouped (grouping.h), every group
// gets a space of its own (group_space.h), in it the self-distance table (self_distance.h) shows similar-posture paths
// (posture_paths.h), and of the intervals these join the greedy choice (repeat_choice.h, equations 2, 3, 5) makes
// primary clips, repeated clips, which refer to a primary one frame by frame, and unique clips.
//
// Every frame is in exactly one clip; no clip runs across a start of the table or a border of two groups; references
// lie inside the primary clip, in the same group. The same result on every number of threads.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/repeats/frame_table.h"
#include "kinespace/repeats/group_space.h"
#include "kinespace/repeats/grouping.h"
#include "kinespace/repeats/posture_paths.h"
#include "kinespace/repeats/repeat_choice.h"
#include "kinespace/repeats/segmentation.h"

namespace kinespace {

struct RepeatOptions {
  SegmentationOptions segmentation = {};
  GroupingOptions grouping = {};
  double variance = 0.95;     // 0.5 to 1: share of a group's variance that its space keeps (the paper: 0.95, 0.98)
  double table_rate_hz = 15;  // 1 to 1000: the self-distance table is computed at this rate, or at the clips' if lower
  int table_frames = 16'000;  // 100 to 200 000: a larger table is computed at a lower rate still
  // 1000 to 1e7: of a clip with more frames in a group, each table holds so many at most, one after another, and no
  // repetition is seen from one to the next. So that a clip that is ten times as long takes ten times the work: a table
  // of all of it would take a hundred times. Over one and a half minutes at 120 Hz.
  int clip_frames = 12'000;
  PathOptions paths = {};
  ChoiceOptions choice = {};
  bool find_repeats = true;  // false: every clip is unique, one for each range of a group (what repetition gains)
  void validate() const;     // throws Error{usage} naming field, value and range
};

struct RepeatClip {
  enum class Kind : std::uint8_t { primary, repeated, unique };
  Kind kind = Kind::unique;
  int group = 0;
  std::int64_t first = 0;
  std::int64_t last = 0;                // exclusive
  int primary = -1;                     // repeated: the index of the clip referred to; else -1
  std::vector<std::int64_t> reference;  // repeated: of each frame, a frame of the primary clip; never falling
  [[nodiscard]] std::int64_t frames() const { return last - first; }
};

// "primary", "repeated", "unique".
[[nodiscard]] std::string_view to_string(RepeatClip::Kind kind);

struct RepeatAnalysis {
  SegmentGrouping grouping;
  std::vector<GroupSpace> spaces;  // of each group
  std::vector<RepeatClip> clips;   // in time
  // Share of all frames in clips of a kind, 0 to 1.
  [[nodiscard]] double share(RepeatClip::Kind kind) const;
};

// Throws Error{bad_input} when a value of the table is not finite, Error{usage} for options out of range.
[[nodiscard]] RepeatAnalysis analyse_repeats(const FrameTable& table, const RepeatOptions& options = {},
                                             const Progress& progress = {});

}  // namespace kinespace
