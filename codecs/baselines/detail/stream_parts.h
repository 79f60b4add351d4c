// What the readers and encoders of this folder share about clips and streams. Private to this folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "kinespace/codecs/stream/clip_table.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/joint_channels.h"

namespace kinespace {

// Channels beyond this, in cm or degrees, are damage.
inline constexpr double largest_channel_value = 1e7;
// Throws Error{bad_input} naming the clip when a channel is beyond it.
void require_encodable(const ChannelCurves& curves, const std::string& clip);

// Cuts the frames of an entry into blocks as the clip table wants them, which mean nothing here.
void fill_blocks(ClipEntry& entry);

// How many frames a stream of that size is believed to have, and the section that makes up for it where clips that
// hardly move take less.
[[nodiscard]] std::int64_t most_frames_of(std::uint64_t stream_size);
void add_padding(std::int64_t frames, std::size_t size, BitstreamWriter& out);

// Throws Error{usage} when frames [first, first + count) of a clip are not there.
void require_frames(const StreamReader& reader, std::size_t clip, int first, int count);

// How far the clips that the reader decodes are from the originals.
[[nodiscard]] MeasuredError measure_error(std::span<const Clip> clips, const StreamReader& reader);

}  // namespace kinespace
