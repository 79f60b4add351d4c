// A library of a folder of clips, built for one bench and removed after it.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bench/scratch_folder.h"
#include "kinespace/library/library_view.h"

namespace kinespace {

class BenchLibrary {
 public:
  // Of the motion files in `folders`; with `every` > 0, every so many-th file is held out. Throws Error{bad_input} when
  // a folder is missing.
  explicit BenchLibrary(const std::vector<std::filesystem::path>& folders, int every = 0);

  [[nodiscard]] LibraryView& view() { return *view_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const std::vector<std::filesystem::path>& held_out() const { return held_out_; }

 private:
  ScratchFolder folder_;  // outlives the view
  std::filesystem::path path_;
  std::vector<std::filesystem::path> held_out_;
  std::unique_ptr<LibraryView> view_;
};

}  // namespace kinespace
