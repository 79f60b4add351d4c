#include "bench/bench_library.h"

#include "kinespace/library/library_builder.h"

namespace kinespace {

BenchLibrary::BenchLibrary(const std::vector<std::filesystem::path>& folders, int every) {
  path_ = folder_.file("bench.kspace");
  std::vector<std::filesystem::path> files;
  int number = 0;
  for (const auto& file : find_motion_files(folders)) {
    const bool held_out = every > 0 && ++number % every == 0;
    (held_out ? held_out_ : files).push_back(file);
  }
  static_cast<void>(build_library(files, path_, {}));
  view_ = std::make_unique<LibraryView>(path_);
}

}  // namespace kinespace
