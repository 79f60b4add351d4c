#include "cli/output.h"

#include <cerrno>
#include <new>

#include <fcntl.h>
#include <unistd.h>

namespace kinespace::cli {

void open_standard_descriptors() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
    // The lowest free number is the one that is missing. Standard output for reading only: writes to it fail.
    static_cast<void>(::open("/dev/null", descriptor == STDERR_FILENO ? O_WRONLY : O_RDONLY));
  }
}

void write_text(std::FILE* stream, std::string_view text) noexcept {
  static_cast<void>(std::fwrite(text.data(), 1, text.size(), stream));  // the stream remembers failure
}

void tell(std::string_view text) noexcept {
  write_text(stderr, "kinespace: ");
  try {
    write_text(stderr, printable(text));
  } catch (const std::bad_alloc&) {
    write_text(stderr, "out of memory");
  }
  write_text(stderr, "\n");
}

bool finish_output() noexcept {
  return std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
}

}  // namespace kinespace::cli
