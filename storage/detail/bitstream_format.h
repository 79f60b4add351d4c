// What the bitstream's writer and reader agree on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace kinespace::bitstream_format {

// A first byte that no text has, then "KSB".
inline constexpr std::array<std::byte, 4> magic = {std::byte{0x8b}, std::byte{'K'}, std::byte{'S'}, std::byte{'B'}};
inline constexpr std::size_t checksum_bytes = 8;

// More than any codec needs, and few enough that a hostile table costs next to no memory.
inline constexpr std::size_t most_sections = 65536;
inline constexpr std::size_t most_options = 65536;

// Flags of the header: which measured errors follow, in this order.
inline constexpr std::uint8_t has_mean_error = 1;
inline constexpr std::uint8_t has_max_error = 2;
inline constexpr std::uint8_t has_shell_error = 4;
inline constexpr std::uint8_t header_flags = has_mean_error | has_max_error | has_shell_error;

// Flags of a section.
inline constexpr std::uint8_t is_progressive = 1;
inline constexpr std::uint8_t section_flags = is_progressive;

// The least an entry takes: of the options (two strings), of the table (name, flags, length, checksum).
inline constexpr std::size_t least_option_bytes = 2;
inline constexpr std::size_t least_entry_bytes = 4 + checksum_bytes;

// A block: length (varint), the low half of its XXH3-64, the bytes.
using BlockChecksum = std::uint32_t;

}  // namespace kinespace::bitstream_format
