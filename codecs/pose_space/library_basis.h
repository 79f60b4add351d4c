// The basis that a library's clips teach, kept in the library.
#pragma once

#include <filesystem>
#include <string>

#include "kinespace/base/progress.h"
#include "kinespace/codecs/pose_space/pose_space_basis.h"

namespace kinespace {

// The basis for clips of that joint tree (Skeleton::tree_hash). Learned from the library's clips, evenly over them, the
// first time it is asked for, and then kept as it is, so that streams stay readable when clips are added. Throws
// Error{usage} when the library has no clips of that tree.
[[nodiscard]] PoseSpaceBasis library_basis(const std::filesystem::path& library, const std::string& tree_hash,
                                           const Progress& progress = {});

// The basis of that id, where a stream names one. Throws Error{usage} when the library does not have it.
[[nodiscard]] PoseSpaceBasis library_basis_by_id(const std::filesystem::path& library, const std::string& id);

}  // namespace kinespace
