#include "kinespace/codecs/stream/clip_reader.h"

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/stream/measured_stream.h"
#include "kinespace/motion/curves.h"

namespace kinespace {

namespace {

Bitstream required(Bitstream stream, bool whole) {
  if (!whole || stream.complete()) return stream;
  throw Error(ErrorKind::bad_input,
              {.file = stream.source(), .found = "the beginning of a stream", .expected = "all of it (cut short)"});
}

}  // namespace

ClipReader::ClipReader(Bitstream stream, std::span<const Skeleton> known, Length length)
    : stream_(required(std::move(stream), length == Length::whole)),
      table_(unpack_clip_table(stream_.section("clips"), most_frames(stream_.available()), stream_.source(), known)) {
  if (stream_.has_section("padding")) static_cast<void>(stream_.section("padding"));
  for (const ClipEntry& clip : table_.clips) summaries_.push_back({clip.name, clip.rate_hz, clip.frames});
}

const Skeleton& ClipReader::skeleton(std::size_t clip) const {
  return table_.skeletons[static_cast<std::size_t>(table_.clips[clip].skeleton)];
}

void ClipReader::require_frames(std::size_t clip, int first, int count) const {
  if (clip < table_.clips.size() && first >= 0 && count >= 1 && first <= entry(clip).frames - count) return;
  throw Error(ErrorKind::usage, {.file = stream_.source(),
                                 .found = fmt::format("{} frames from {} of clip {}", count, first, clip),
                                 .expected = "frames that the stream has"});
}

Clip ClipReader::decode(std::size_t clip, int first, int count, int level) const {
  require_frames(clip, first, count);
  return part(clip, first, count, level);
}

std::vector<Clip> ClipReader::decode_all(int level) const {
  std::vector<Clip> out(table_.clips.size());
  parallel_for(std::size_t{0}, out.size(), [&](std::size_t c) { out[c] = part(c, 0, entry(c).frames, level); });
  return out;
}

Clip ClipReader::at_rest(std::size_t clip, int first, int count) const {
  Clip out = make_clip(entry(clip).name, skeleton(clip), entry(clip).rate_hz, count);
  out.require_translation_track(out.skeleton.travel_root());
  for (const SideTrack& track : entry(clip).side_tracks) apply_side_track(track, first, out);
  return out;
}

Clip cut(Clip clip, int first, int count) {
  if (first == 0 && count == clip.frames) return clip;
  return slice(clip, first, count);
}

}  // namespace kinespace
