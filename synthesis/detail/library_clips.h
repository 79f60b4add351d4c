// Clips of a library that are to be played together.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "kinespace/library/library_view.h"

namespace kinespace {

// The clips of these names, in their order. Throws Error{usage} for an unknown name and Error{bad_input} naming two
// clips of different skeletons.
[[nodiscard]] std::vector<ClipRow> clips_of_one_tree(const LibraryView& library, std::span<const std::string> names);

// Whether the clip has every one of these labels.
[[nodiscard]] bool has_labels(const ClipRow& row, std::span<const std::string> wanted);

}  // namespace kinespace
