// The versions of the bitstream's layout, oldest first. Append only: a version that has been written must stay
// readable, and tests/storage/fixtures keeps a stream of each.
#pragma once

#include <cstdint>

namespace kinespace {

enum class BitstreamVersion : std::uint64_t {
  first = 1,  // magic, header with its checksum (kind, options, measured errors, table of sections), sections

  newest = first,
};

}  // namespace kinespace
