// Clips of a bench, read and cut.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kinespace/fpca/space_builder.h"

namespace kinespace {

struct PreparedSet {
  std::string name;
  std::vector<Clip> clips;
  std::vector<PreparedClip> prepared;  // one a clip
};

// All clips among the files and folders, by path. Throws Error{bad_input} for what is not there.
[[nodiscard]] PreparedSet load_prepared_set(const std::string& name, const std::vector<std::filesystem::path>& inputs,
                                            const SequenceOptions& options = {});

// The same clips cut otherwise.
[[nodiscard]] PreparedSet cut_again(const PreparedSet& set, const SequenceOptions& options);

// Every clip in the space that was built of the set.
[[nodiscard]] std::vector<EncodedClip> encode_all(const PreparedSet& set, const BuiltSpace& built);

}  // namespace kinespace
