// General compressors of bytes. Private to this folder.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "kinespace/base/bytes.h"
#include "kinespace/codecs/baselines/raw_codec.h"

namespace kinespace {

// The highest level of each: what its decoder needs stays below 40 MiB.
inline constexpr int highest_zstd_level = 19;
inline constexpr int highest_xz_level = 8;

// Throws Error{machine} when there is no memory for it.
[[nodiscard]] Bytes pack_bytes(Packer packer, int level, std::span<const std::byte> bytes);
// What unpacks to exactly so many bytes. Throws Error{bad_input} naming `source`.
[[nodiscard]] Bytes unpack_bytes(Packer packer, std::span<const std::byte> packed, std::size_t size,
                                 const std::string& source);

}  // namespace kinespace
