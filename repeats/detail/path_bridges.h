// Paths that begin a little to the lower right of where another ends go on from there (lin2011 section 4.2.1, step 6).
// Private to this folder.
#pragma once

#include <vector>

#include "kinespace/repeats/posture_paths.h"

namespace kinespace {

// `longest`: extent of a bridge along either axis, in pixels. The longest paths choose first, each the nearest begin; a
// begin is reached once. A bridge is filled with the pixels on the line between its ends.
[[nodiscard]] std::vector<PosturePath> bridge_paths(const SelfDistance& table, std::vector<PosturePath> paths,
                                                    int longest);

}  // namespace kinespace
