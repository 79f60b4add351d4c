#include "kinespace/codecs/stream/measured_stream.h"

#include <algorithm>

#include "kinespace/base/parallel.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

constexpr std::int64_t free_frames = 65536, frames_a_byte = 256;
constexpr std::int64_t free_numbers = std::int64_t{1} << 21, numbers_a_byte = 4;

std::int64_t believed(std::uint64_t bytes, std::int64_t free, std::int64_t a_byte) {
  return free + a_byte * static_cast<std::int64_t>(std::min<std::uint64_t>(bytes, std::uint64_t{1} << 40));
}

std::int64_t bytes_for(std::int64_t count, std::int64_t free, std::int64_t a_byte) {
  return (count - free + a_byte - 1) / a_byte;
}

}  // namespace

std::int64_t most_frames(std::uint64_t stream_bytes) {
  return believed(stream_bytes, free_frames, frames_a_byte);
}

std::int64_t most_numbers(std::uint64_t stream_bytes) {
  return believed(stream_bytes, free_numbers, numbers_a_byte);
}

void add_padding(BitstreamWriter& out, std::size_t bytes, std::int64_t frames, std::int64_t numbers) {
  const std::int64_t needed =
      std::max(bytes_for(frames, free_frames, frames_a_byte), bytes_for(numbers, free_numbers, numbers_a_byte));
  const auto size = static_cast<std::int64_t>(bytes);
  if (needed > size) out.add_section("padding", Bytes(static_cast<std::size_t>(needed - size), std::byte{0}));
}

Bytes pack_parts(std::span<const Bytes> parts) {
  ByteWriter out;
  for (const Bytes& part : parts) put_varint(out, part.size());
  for (const Bytes& part : parts) out.put_bytes(part);
  return std::move(out).take();
}

std::vector<std::span<const std::byte>> unpack_parts(std::span<const std::byte> bytes, std::size_t count,
                                                     const char* what, const std::string& source) {
  ByteReader in(bytes, source);
  std::vector<std::size_t> sizes;
  for (std::size_t i = 0; i < count; ++i) sizes.push_back(get_count(in, 1, what));
  std::vector<std::span<const std::byte>> out;
  out.reserve(sizes.size());
  for (const std::size_t size : sizes) out.push_back(in.take(size));
  in.expect_end();
  return out;
}

MeasuredError measured_error(std::span<const Clip> originals, const StreamReader& reader) {
  std::vector<ClipErrorSums> parts(originals.size());
  parallel_for(std::size_t{0}, originals.size(), [&](std::size_t c) {
    parts[c] = clip_error(originals[c], reader.decode(c), 0, originals[c].frames, 0);
  });
  ClipErrorSums out;
  for (const ClipErrorSums& part : parts) out.add(part);
  return out.measured();
}

CodedAttempt write_measured(std::span<const Clip> originals, const std::function<Bytes(const MeasuredError&)>& write,
                            const std::function<std::unique_ptr<StreamReader>(Bitstream)>& open) {
  const Bytes draft = write({});
  const MeasuredError error = measured_error(originals, *open(Bitstream::parse(draft, "the stream")));
  return {write(error), error};
}

}  // namespace kinespace
