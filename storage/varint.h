// Whole numbers in as few bytes as they need.
//
// LEB128: seven bits a byte, the lowest first; the top bit says that more follow. One encoding a number: what is longer
// than it must be is refused, so a damaged stream does not pass for another spelling of the same one. Signed numbers go
// through zigzag (0, -1, 1, -2, ... become 0, 1, 2, 3, ...), so that small ones of either sign stay short.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "kinespace/base/bytes.h"

namespace kinespace {

[[nodiscard]] constexpr std::uint64_t zigzag(std::int64_t value) noexcept {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}

[[nodiscard]] constexpr std::int64_t unzigzag(std::uint64_t value) noexcept {
  return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
}

// How many bytes put_varint writes: 1 to 10.
[[nodiscard]] constexpr std::size_t varint_size(std::uint64_t value) noexcept {
  std::size_t size = 1;
  for (; value >= 0x80; value >>= 7) ++size;
  return size;
}

inline void put_varint(ByteWriter& out, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) out.put(static_cast<std::uint8_t>(value | 0x80));
  out.put(static_cast<std::uint8_t>(value));
}

inline void put_signed_varint(ByteWriter& out, std::int64_t value) {
  put_varint(out, zigzag(value));
}

// Throws Error{bad_input} when the bytes run out, the number does not fit 64 bits or is longer than it must be.
[[nodiscard]] inline std::uint64_t get_varint(ByteReader& in) {
  std::uint64_t value = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    const auto byte = in.get<std::uint8_t>();
    const std::uint64_t bits = byte & 0x7fU;
    const bool overflows = shift == 63 && bits > 1;
    const bool padded = shift > 0 && byte == 0;
    if (overflows || padded) break;
    value |= bits << shift;
    if ((byte & 0x80U) == 0) return value;
  }
  in.fail("a number of variable length that is damaged", "at most 64 bits in as few bytes as they need");
}

[[nodiscard]] inline std::int64_t get_signed_varint(ByteReader& in) {
  return unzigzag(get_varint(in));
}

// A count of things that take at least `bytes_each` bytes of what follows, so that it can be allocated for.
// `what` names the things in the message.
[[nodiscard]] inline std::size_t get_count(ByteReader& in, std::size_t bytes_each, const char* what) {
  const std::uint64_t count = get_varint(in);
  if (count > in.remaining() / bytes_each) {
    in.fail(std::to_string(count) + " " + what + " in " + std::to_string(in.remaining()) + " bytes",
            "a count that fits (cut short or damaged)");
  }
  return static_cast<std::size_t>(count);
}

// A part within a section: its length as put_varint writes it, then its bytes.
inline void put_part(ByteWriter& out, std::span<const std::byte> part) {
  put_varint(out, part.size());
  out.put_bytes(part);
}

// `what` names the bytes in the message: "bytes of a table".
[[nodiscard]] inline std::span<const std::byte> get_part(ByteReader& in, const char* what) {
  return in.take(get_count(in, 1, what));
}

// Likewise of characters.
inline void put_short_string(ByteWriter& out, std::string_view text) {
  put_varint(out, text.size());
  out.put_array(std::span<const char>(text.data(), text.size()));
}

[[nodiscard]] inline std::string get_short_string(ByteReader& in) {
  const auto raw = in.take(get_count(in, 1, "characters"));
  return {reinterpret_cast<const char*>(raw.data()), raw.size()};
}

}  // namespace kinespace
