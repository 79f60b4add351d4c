// The sample motions as files, for commands to read.
#pragma once

#include <filesystem>

#include "examples/sample_motions.h"
#include "kinespace/motion/read.h"

namespace kinespace::test {

// Makes the folder; one clip of each kind, as BVH.
inline void write_sample_clips(const std::filesystem::path& folder) {
  std::filesystem::create_directory(folder);
  for (const SampleMotion& motion : sample_library({.takes = 1})) {
    write_clip(folder / (motion.clip.name + ".bvh"), motion.clip);
  }
}

}  // namespace kinespace::test
