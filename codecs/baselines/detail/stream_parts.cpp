#include "kinespace/codecs/baselines/detail/stream_parts.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/stream/clip_error.h"

namespace kinespace {
namespace {

constexpr std::int64_t free_frames = 65536, frames_a_byte = 256;

}  // namespace

void require_encodable(const ChannelCurves& curves, const std::string& clip) {
  for (const double v : curves.values) {
    if (std::abs(v) < largest_channel_value) continue;
    throw Error(ErrorKind::bad_input, {.file = clip,
                                       .found = "a root farther than 100 km away, or a joint that turned 30 000 times",
                                       .expected = "positions in centimetres and rotations"});
  }
}

void fill_blocks(ClipEntry& entry) {
  entry.blocks.assign(static_cast<std::size_t>(entry.frames / longest_block), longest_block);
  if (entry.frames % longest_block > 0) entry.blocks.push_back(entry.frames % longest_block);
  entry.finer.assign(entry.blocks.size(), 0);
}

std::int64_t most_frames_of(std::uint64_t stream_size) {
  return free_frames + frames_a_byte * static_cast<std::int64_t>(std::min<std::uint64_t>(stream_size, 1ULL << 40));
}

void add_padding(std::int64_t frames, std::size_t size, BitstreamWriter& out) {
  const std::int64_t needed = (frames - free_frames + frames_a_byte - 1) / frames_a_byte;
  if (needed > static_cast<std::int64_t>(size)) {
    out.add_section("padding", Bytes(static_cast<std::size_t>(needed) - size, std::byte{0}));
  }
}

void require_frames(const StreamReader& reader, std::size_t clip, int first, int count) {
  const auto clips = reader.clips();
  if (clip < clips.size() && first >= 0 && count >= 1 && first <= clips[clip].frames - count) return;
  throw Error(ErrorKind::usage, {.file = reader.stream().source(),
                                 .found = fmt::format("{} frames from {} of clip {}", count, first, clip),
                                 .expected = "frames that the stream has"});
}

MeasuredError measure_error(std::span<const Clip> clips, const StreamReader& reader) {
  const std::vector<Clip> decoded = reader.decode_all();
  std::vector<ClipErrorSums> parts(clips.size());
  tbb::parallel_for(std::size_t{0}, clips.size(),
                    [&](std::size_t c) { parts[c] = clip_error(clips[c], decoded[c], 0, clips[c].frames, 0); });
  ClipErrorSums out;
  for (const ClipErrorSums& part : parts) out.add(part);
  return out.measured();
}

}  // namespace kinespace
