#include "kinespace/repeats/detail/table_parts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace kinespace {
namespace {

std::int64_t frames_of(std::span<const FrameSpan> ranges) {
  std::int64_t frames = 0;
  for (const FrameSpan& range : ranges) frames += range.frames();
  return frames;
}

// As many parts as it takes for none to have more than `most` frames, of about equal size.
void append_parts(std::span<const FrameSpan> ranges, std::int64_t most, int stride, std::vector<TablePart>& out) {
  const std::int64_t frames = frames_of(ranges);
  const std::int64_t parts = (frames + most - 1) / most;
  std::int64_t room = 0;
  for (FrameSpan range : ranges) {
    while (range.frames() > 0) {
      if (room == 0) {
        out.push_back({{}, stride});
        room = (frames + parts - 1) / parts;
      }
      const std::int64_t taken = std::min(room, range.frames());
      out.back().ranges.push_back({range.first, range.first + taken});
      range.first += taken;
      room -= taken;
    }
  }
}

// The ranges, in time, clip by clip.
std::vector<std::span<const FrameSpan>> by_clip(std::span<const FrameSpan> ranges, const FrameTable& table) {
  const auto clip_of = [&](const FrameSpan& range) { return std::ranges::upper_bound(table.starts, range.first); };
  std::vector<std::span<const FrameSpan>> out;
  for (std::size_t first = 0; first < ranges.size();) {
    std::size_t last = first + 1;
    while (last < ranges.size() && clip_of(ranges[last]) == clip_of(ranges[first])) ++last;
    out.push_back(ranges.subspan(first, last - first));
    first = last;
  }
  return out;
}

}  // namespace

std::vector<TablePart> table_parts(std::span<const FrameSpan> ranges, const FrameTable& table,
                                   const RepeatOptions& options) {
  const auto most = static_cast<std::int64_t>(options.table_frames);
  const int stride = std::max(1, static_cast<int>(std::lround(table.rate_hz / options.table_rate_hz)));
  std::vector<TablePart> out;
  std::vector<FrameSpan> together;
  for (const auto clip : by_clip(ranges, table)) {
    if (frames_of(clip) > options.clip_frames) {
      append_parts(clip, std::min<std::int64_t>(options.clip_frames, most * stride), stride, out);
    } else {
      together.insert(together.end(), clip.begin(), clip.end());
    }
  }
  const int wide = frames_of(together) > most * stride ? 2 * stride : stride;
  append_parts(together, most * wide, wide, out);
  return out;
}

}  // namespace kinespace
