// A folder of sample clips and the library of it.
#pragma once

#include <filesystem>

#include "examples/sample_motions.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"
#include "tests/support/data.h"

namespace kinespace::test {

class LibraryFolder {
 public:
  LibraryFolder() {
    std::filesystem::create_directory(clips());
    int number = 0;
    for (const SampleMotion& motion : sample_library({.takes = 1})) {
      write_clip(clips() / (motion.clip.name + ".bvh"), motion.clip);
      ++number;
    }
    count_ = number;
  }
  [[nodiscard]] std::filesystem::path clips() const { return folder_ / "clips"; }
  [[nodiscard]] std::filesystem::path library() const { return folder_ / "library.kspace"; }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] LibraryReport build(const LibraryBuilderOptions& options = {}) const {
    return build_library(find_motion_files({clips()}), library(), options);
  }

 private:
  TemporaryFolder folder_;
  int count_ = 0;
};

}  // namespace kinespace::test
