#include "kinespace/codecs/baselines/detail/packers.h"

#include <cstdint>

#include <lzma.h>
#include <zstd.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

constexpr std::uint64_t xz_memory = std::uint64_t{40} << 20;

[[noreturn]] void no_memory() {
  throw Error(ErrorKind::machine, {.found = "no memory for the compressor", .expected = "some"});
}

const std::uint8_t* raw(std::span<const std::byte> bytes) {
  return reinterpret_cast<const std::uint8_t*>(bytes.data());
}

Bytes pack_zstd(int level, std::span<const std::byte> bytes) {
  Bytes out(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), level);
  if (ZSTD_isError(size) != 0U) no_memory();
  out.resize(size);
  return out;
}

bool unpack_zstd(std::span<const std::byte> packed, Bytes& out) {
  const std::size_t size = ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size());
  return ZSTD_isError(size) == 0U && size == out.size();
}

// Streams stand behind a checksum, so xz's own is left out.
Bytes pack_xz(int level, std::span<const std::byte> bytes) {
  Bytes out(lzma_stream_buffer_bound(bytes.size()));
  std::size_t size = 0;
  const lzma_ret result =
      lzma_easy_buffer_encode(static_cast<std::uint32_t>(level), LZMA_CHECK_NONE, nullptr, raw(bytes), bytes.size(),
                              reinterpret_cast<std::uint8_t*>(out.data()), &size, out.size());
  if (result != LZMA_OK) no_memory();
  out.resize(size);
  return out;
}

bool unpack_xz(std::span<const std::byte> packed, Bytes& out) {
  std::uint64_t memory = xz_memory;
  std::size_t used = 0, made = 0;
  const lzma_ret result = lzma_stream_buffer_decode(&memory, 0, nullptr, raw(packed), &used, packed.size(),
                                                    reinterpret_cast<std::uint8_t*>(out.data()), &made, out.size());
  return result == LZMA_OK && used == packed.size() && made == out.size();
}

}  // namespace

Bytes pack_bytes(Packer packer, int level, std::span<const std::byte> bytes) {
  return packer == Packer::zstd ? pack_zstd(level, bytes) : pack_xz(level, bytes);
}

Bytes unpack_bytes(Packer packer, std::span<const std::byte> packed, std::size_t size, const std::string& source) {
  Bytes out(size);
  if (packer == Packer::zstd ? unpack_zstd(packed, out) : unpack_xz(packed, out)) return out;
  throw Error(ErrorKind::bad_input, {.file = source,
                                     .found = "packed channels that are damaged or of another length",
                                     .expected = std::to_string(size) + " bytes"});
}

}  // namespace kinespace
