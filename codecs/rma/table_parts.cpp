#include "codecs/rma/table_parts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace kinespace {

std::vector<TablePart> table_parts(std::span<const FrameSpan> ranges, double rate_hz, const RepeatOptions& options) {
  std::int64_t frames = 0;
  for (const FrameSpan& range : ranges) frames += range.frames();
  const auto most = static_cast<std::int64_t>(options.table_frames);
  int stride = std::max(1, static_cast<int>(std::lround(rate_hz / options.table_rate_hz)));
  if (frames > most * stride) stride *= 2;
  const std::int64_t parts = (frames + most * stride - 1) / (most * stride);
  const std::int64_t part_frames = (frames + parts - 1) / parts;

  std::vector<TablePart> out;
  std::int64_t room = 0;
  for (FrameSpan range : ranges) {
    while (range.frames() > 0) {
      if (room == 0) {
        out.push_back({{}, stride});
        room = part_frames;
      }
      const std::int64_t taken = std::min(room, range.frames());
      out.back().ranges.push_back({range.first, range.first + taken});
      range.first += taken;
      room -= taken;
    }
  }
  return out;
}

}  // namespace kinespace
