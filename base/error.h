// The one exception type of the library.
//
// Thrown for bad input (a file, a stream, an option) and for a machine that cannot go on (disk full, no memory).
// Programming errors assert. "No device", "did not converge" and "no match" are returned states, not errors.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace kinespace {

// What went wrong, by who can mend it. The values are the exit codes of the command.
enum class ErrorKind : int {
  bad_input = 1,  // the data: mend the file
  usage = 2,      // the call: mend the options
  machine = 3,    // the machine: disk, memory, permissions
};

// The parts of a good message; empty parts are left out. `line` counts from 1; 0 means the file has no lines.
struct ErrorDetails {
  std::string file;
  std::int64_t line = 0;
  std::string found;
  std::string expected;
  std::string remedy;
};

class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, ErrorDetails details);

  [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }
  [[nodiscard]] const ErrorDetails& details() const noexcept { return details_; }

 private:
  ErrorKind kind_;
  ErrorDetails details_;
};

// "FILE:LINE: found X, expected Y; REMEDY" on one line, fit for a terminal (base/printable.h).
[[nodiscard]] std::string format_error(const ErrorDetails& details);

}  // namespace kinespace
