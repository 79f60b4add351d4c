// What the encoders of all codecs of clips share: how much a reader believes of how many bytes, parts of a section one after
// the other, and streams that tell how far the clips that they decode to are from the originals.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "kinespace/codecs/stream/codec.h"
#include "kinespace/storage/bitstream.h"

namespace kinespace {

// How many frames a stream of so many bytes is believed to have, and how many numbers: what a reader allocates for.
[[nodiscard]] std::int64_t most_frames(std::uint64_t stream_bytes);
[[nodiscard]] std::int64_t most_numbers(std::uint64_t stream_bytes);
// The section that makes up for it where motion that hardly moves takes less than `bytes`.
void add_padding(BitstreamWriter& out, std::size_t bytes, std::int64_t frames, std::int64_t numbers = 0);

// Parts of a section: their lengths as varints, then the parts.
[[nodiscard]] Bytes pack_parts(std::span<const Bytes> parts);
// `what` they are, for errors. Throws Error{bad_input} naming `source` when there are not just `count`.
[[nodiscard]] std::vector<std::span<const std::byte>> unpack_parts(std::span<const std::byte> bytes, std::size_t count,
                                                                   const char* what, const std::string& source);

struct CodedAttempt {
  Bytes stream;
  MeasuredError error;
};

// How far the clips that a reader decodes to are from the originals.
[[nodiscard]] MeasuredError measured_error(std::span<const Clip> originals, const StreamReader& reader);
// Writes a stream twice: a draft to decode and measure, then with what was measured in its header.
[[nodiscard]] CodedAttempt write_measured(std::span<const Clip> originals,
                                          const std::function<Bytes(const MeasuredError&)>& write,
                                          const std::function<std::unique_ptr<StreamReader>(Bitstream)>& open);

}  // namespace kinespace
