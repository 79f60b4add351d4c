#include "kinespace/storage/packed_floats.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <string>

#include <zstd.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

enum class Layout : std::uint8_t { plain = 0, shuffled = 1 };

constexpr std::size_t run = 16384;  // floats that are shuffled together: 64 KiB, which stay in the cache
constexpr std::size_t lanes = sizeof(float);
constexpr std::size_t unbounded = std::size_t{1} << 20;  // bytes of floats that may come from any few packed bytes
constexpr std::size_t most_growth = 15;

// The least that `bytes` of floats may be packed into.
std::size_t least_packed(std::size_t bytes) {
  return bytes <= unbounded ? 0 : (bytes - unbounded) / most_growth + 1;
}

void shuffle(std::span<const std::byte> in, std::span<std::byte> out) {
  const std::size_t count = in.size() / lanes;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    for (std::size_t i = 0; i < count; ++i) out[lane * count + i] = in[i * lanes + lane];
  }
}

void unshuffle(std::span<const std::byte> in, std::span<std::byte> out) {
  const std::size_t count = in.size() / lanes;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    for (std::size_t i = 0; i < count; ++i) out[i * lanes + lane] = in[lane * count + i];
  }
}

[[noreturn]] void damaged(const std::string& source, std::string found, std::string expected) {
  throw Error(ErrorKind::bad_input, {.file = source, .found = std::move(found), .expected = std::move(expected)});
}

Bytes plain(std::span<const std::byte> raw) {
  ByteWriter out;
  out.put(static_cast<std::uint8_t>(Layout::plain));
  out.put_bytes(raw);
  return std::move(out).take();
}

}  // namespace

void PackedFloatsOptions::validate() const {
  if (level < 1 || level > 19) {
    throw Error(ErrorKind::usage, {.file = {}, .found = "level = " + std::to_string(level), .expected = "1 to 19"});
  }
}

Bytes pack_floats(std::span<const float> values, const PackedFloatsOptions& options) {
  options.validate();
  const auto raw = std::as_bytes(values);
  Bytes shuffled(raw.size());
  for (std::size_t at = 0; at < raw.size(); at += run * lanes) {
    const std::size_t size = std::min(run * lanes, raw.size() - at);
    shuffle(raw.subspan(at, size), std::span(shuffled).subspan(at, size));
  }
  Bytes out(1 + ZSTD_compressBound(raw.size()));
  out[0] = static_cast<std::byte>(Layout::shuffled);
  const std::size_t size =
      ZSTD_compress(out.data() + 1, out.size() - 1, shuffled.data(), shuffled.size(), options.level);
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();  // the buffer is large enough: only memory can be short
  if (size >= raw.size()) return plain(raw);
  out.resize(std::max(1 + size, least_packed(raw.size())));
  std::fill(out.begin() + static_cast<std::ptrdiff_t>(1 + size), out.end(), std::byte{0});
  out.shrink_to_fit();
  return out;
}

std::vector<float> unpack_floats(std::span<const std::byte> packed, std::size_t count, const std::string& source) {
  if (packed.empty()) damaged(source, "no bytes of packed floats", "at least one");
  const auto layout = static_cast<Layout>(packed[0]);
  const auto content = packed.subspan(1);
  if (layout == Layout::plain) {
    if (content.size() % lanes != 0 || content.size() / lanes != count) {
      damaged(source, std::to_string(content.size()) + " bytes of floats", std::to_string(count) + " floats");
    }
    std::vector<float> values(count);
    if (count > 0) std::memcpy(values.data(), content.data(), content.size());
    return values;
  }
  if (layout != Layout::shuffled) damaged(source, "an unknown layout of packed floats", "0 or 1");
  const std::size_t frame = ZSTD_findFrameCompressedSize(content.data(), content.size());
  const unsigned long long size = ZSTD_getFrameContentSize(content.data(), content.size());
  if (ZSTD_isError(frame) != 0 || size % lanes != 0 || size / lanes != count || least_packed(size) > packed.size()) {
    damaged(source, "packed floats that are damaged", std::to_string(count) + " floats");
  }
  std::vector<float> values(count);
  const auto raw = std::as_writable_bytes(std::span(values));
  if (ZSTD_decompress(raw.data(), raw.size(), content.data(), frame) != raw.size()) {
    damaged(source, "packed floats that are damaged", std::to_string(count) + " floats");
  }
  std::vector<std::byte> work(std::min(run * lanes, raw.size()));
  for (std::size_t at = 0; at < raw.size(); at += run * lanes) {
    const auto part = raw.subspan(at, std::min(run * lanes, raw.size() - at));
    std::ranges::copy(part, work.begin());
    unshuffle(std::span(work).first(part.size()), part);
  }
  return values;
}

}  // namespace kinespace
