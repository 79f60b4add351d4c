// Files of a batch that cannot be read, and why: the others are read all the same.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kinespace/base/error.h"

namespace kinespace {

struct BadFile {
  std::filesystem::path file;
  ErrorDetails error;  // what its reader says of it

  [[nodiscard]] std::string reason() const { return format_error(error); }
};

// For when nothing is left: throws Error{bad_input} with the fault of the one file, or of the first of several. Does
// nothing when the list is empty.
void require_no_bad_files(const std::vector<BadFile>& bad);

// Runs `read`; where it finds fault with its file, that is added to the list. Other errors (of the machine, of usage) go
// on. True when the file was read.
template <typename Read>
bool read_or_list(std::vector<BadFile>& bad, const std::filesystem::path& file, const Read& read) {
  try {
    read();
    return true;
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::bad_input) throw;
    bad.push_back({file, error.details()});
    return false;
  }
}

}  // namespace kinespace
