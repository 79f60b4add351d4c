// How the self-distance tables of a group are cut and sampled so that time and memory stay bounded. Private to this
// folder.
#pragma once

#include <span>
#include <vector>

#include "kinespace/repeats/repeats.h"

namespace kinespace {

// One table: ranges of one group, in time, and the frames that a pixel stands for.
struct TablePart {
  std::vector<FrameSpan> ranges;
  int stride = 1;
};

// A group too large for one table at `table_rate_hz` gets one at half that rate; one that is too large still, several
// tables of about equal size, between which no repetition is seen. A clip of more than `clip_frames` frames in the
// group has tables of its own, of at most that many frames each.
[[nodiscard]] std::vector<TablePart> table_parts(std::span<const FrameSpan> ranges, const FrameTable& table,
                                                 const RepeatOptions& options);

}  // namespace kinespace
