#include "kinespace/library/bad_files.h"

#include <fmt/format.h>

namespace kinespace {

void require_no_bad_files(const std::vector<BadFile>& bad) {
  if (bad.empty()) return;
  ErrorDetails details = bad.front().error;
  if (bad.size() > 1) {
    details.remedy += fmt::format("{}{} more cannot be read", details.remedy.empty() ? "" : "; ", bad.size() - 1);
  }
  throw Error(ErrorKind::bad_input, std::move(details));
}

}  // namespace kinespace
