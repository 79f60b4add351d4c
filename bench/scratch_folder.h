// A folder for what a bench writes on its way.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

namespace kinespace {

// Goes, with all that is in it, when its owner does.
class ScratchFolder {
 public:
  // Throws std::filesystem::filesystem_error where none can be made.
  ScratchFolder() {
    for (int number = 0; path_.empty() || !std::filesystem::create_directory(path_); ++number) {
      path_ = std::filesystem::temp_directory_path() / fmt::format("kinespace-bench-{}-{}", ::getpid(), number);
    }
  }
  ~ScratchFolder() {
    std::error_code ignored;  // what is left in the temporary folder does no harm
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] std::filesystem::path file(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace kinespace
