// Arrays of 32-bit floats without loss, in fewer bytes.
//
// The bytes of the floats are sorted by their place (all lowest bytes, then the next; in runs of 16384 floats) and
// given to zstd: in smooth data the upper bytes repeat. One leading byte says whether that made it smaller; if not, the
// floats follow as they are. NaNs, infinities and negative zeros keep their bits.
//
// What it does not do: store the count (the caller has it, and it bounds what is allocated) or a checksum (the sections
// of a bitstream have theirs).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"

namespace kinespace {

struct PackedFloatsOptions {
  // zstd's level, 1 to 19. 5 packs motion data at some 100 MB/s; higher ones gain a few percent and cost much.
  int level = 5;

  // Throws Error{usage}.
  void validate() const;
};

[[nodiscard]] Bytes pack_floats(std::span<const float> values, const PackedFloatsOptions& options = {});

// The `count` floats that were packed. Throws Error{bad_input} naming `source` when the bytes are damaged or hold
// another count. Memory stays below 16 times the packed bytes + 2 MiB whatever the bytes and the count say: pack_floats
// pads what would be smaller than that.
[[nodiscard]] std::vector<float> unpack_floats(std::span<const std::byte> packed, std::size_t count,
                                               const std::string& source);

}  // namespace kinespace
