// What becomes of a batch in which some files cannot be read: the others are used, these are listed at the end, and the
// command fails unless --skip-bad says that this is fine.
#pragma once

#include <filesystem>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/json_output.h"
#include "cli/session.h"
#include "kinespace/library/bad_files.h"

namespace kinespace::cli {

// --skip-bad
void add_skip_bad(CLI::App* command, bool& skip_bad);

class BadFiles {
 public:
  BadFiles() = default;
  explicit BadFiles(std::vector<BadFile> files) : files_(std::move(files)) {}

  // Reads a file, or remembers what is wrong with it.
  template <typename Read>
  void guard(const std::filesystem::path& file, const Read& read) {
    static_cast<void>(read_or_list(files_, file, read));
  }
  [[nodiscard]] const std::vector<BadFile>& files() const { return files_; }

  // Lists them. Throws Error{bad_input} when there are any, unless they are to be skipped.
  void tell(bool skip_bad, Session& session) const;

 private:
  std::vector<BadFile> files_;
};

// [{"file": ..., "reason": ...}]
[[nodiscard]] Json to_json(const BadFiles& bad);

}  // namespace kinespace::cli
