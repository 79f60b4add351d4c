#include "bench/bench_library.h"

#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

#include "fpca/library_builder.h"

namespace kinespace {

BenchLibrary::BenchLibrary(const std::vector<std::filesystem::path>& folders, int every) {
  static int count = 0;
  folder_ = std::filesystem::temp_directory_path() / fmt::format("kinespace-bench-{}-{}", ::getpid(), count++);
  std::filesystem::create_directories(folder_);
  path_ = folder_ / "bench.kspace";
  std::vector<std::filesystem::path> files;
  int number = 0;
  for (const auto& file : find_motion_files(folders)) {
    const bool held_out = every > 0 && ++number % every == 0;
    (held_out ? held_out_ : files).push_back(file);
  }
  static_cast<void>(build_library(files, path_, {}));
  view_ = std::make_unique<LibraryView>(path_);
}

BenchLibrary::~BenchLibrary() {
  view_.reset();
  std::error_code ignored;  // what is left in the temporary folder does no harm
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace kinespace
