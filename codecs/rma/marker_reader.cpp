#include "kinespace/codecs/rma/marker_reader.h"

#include <algorithm>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/rma/marker_stream.h"

namespace kinespace {

MarkerReader::MarkerReader(Bitstream stream)
    : stream_(std::move(stream)),
      table_(unpack_clip_table(stream_.section("clips"), most_frames(stream_.size()), stream_.source())) {
  if (!stream_.complete()) {
    throw Error(ErrorKind::bad_input,
                {.file = stream_.source(), .found = "the beginning of a stream", .expected = "all of it (cut short)"});
  }
  for (const ClipEntry& clip : table_.clips) summaries_.push_back({clip.name, clip.rate_hz, clip.frames});
}

const Skeleton& MarkerReader::skeleton(std::size_t clip) const {
  return table_.skeletons[static_cast<std::size_t>(table_.clips[clip].skeleton)];
}

int MarkerReader::dimensions() const {
  return 3 + 6 * static_cast<int>(table_.skeletons.front().rotating_joints().size());
}

Clip MarkerReader::decode(std::size_t clip, int first, int count, int) const {
  const bool there =
      clip < table_.clips.size() && first >= 0 && count >= 1 && first <= table_.clips[clip].frames - count;
  if (!there) {
    throw Error(ErrorKind::usage, {.file = stream_.source(),
                                   .found = fmt::format("frames {} to {} of clip {}", first, first + count, clip),
                                   .expected = "frames that the stream has"});
  }
  Clip out = whole(clip);
  if (first == 0 && count == out.frames) return out;
  return slice(out, first, count);
}

std::vector<Clip> MarkerReader::decode_all(int) const {
  std::vector<Clip> out(table_.clips.size());
  tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t c) { out[c] = whole(c); });
  return out;
}

std::int64_t most_frames(std::size_t bytes) {
  return 65536 + 256 * static_cast<std::int64_t>(bytes);
}

void add_padding(BitstreamWriter& out, std::size_t bytes, std::int64_t frames, std::int64_t numbers) {
  const std::int64_t for_frames = (frames - most_frames(0) + 255) / 256;
  const std::int64_t for_numbers = (numbers - most_numbers(0) + 3) / 4;
  const std::int64_t needed = std::max(for_frames, for_numbers);
  const auto size = static_cast<std::int64_t>(bytes);
  if (needed > size) out.add_section("padding", Bytes(static_cast<std::size_t>(needed - size), std::byte{0}));
}

}  // namespace kinespace
