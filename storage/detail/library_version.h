// The versions of the library file, oldest first, as PRAGMA user_version has them. Append only: a version that has been
// released must stay readable, and tests/storage/fixtures keeps a library of each.
#pragma once

#include <cstdint>

namespace kinespace {

enum class LibraryVersion : std::int32_t {
  first = 1,  // metadata, skeletons, spaces, clips with labels, vectors, warps, side data, retrieval vectors; artifacts

  newest = first,
};

}  // namespace kinespace
