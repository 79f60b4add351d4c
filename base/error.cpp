#include "kinespace/base/error.h"

#include <utility>

#include "kinespace/base/printable.h"

namespace kinespace {
namespace {

// File contents end up in messages; a terminal must not obey them.
std::string shown_part(const std::string& text) {
  constexpr std::size_t longest = 300;
  if (text.size() <= longest) return printable(text);
  return printable(cut_text(text, longest)) + "...";
}

}  // namespace

std::string format_error(const ErrorDetails& details) {
  std::string out;
  if (!details.file.empty()) {
    out += shown_part(details.file);
    if (details.line > 0) out += ":" + std::to_string(details.line);
    out += ": ";
  }
  if (!details.found.empty()) out += shown_part(details.found);
  if (!details.expected.empty()) {
    out += details.found.empty() ? "expected " : ", expected ";
    out += shown_part(details.expected);
  }
  if (!details.remedy.empty()) out += "; " + shown_part(details.remedy);
  return out;
}

Error::Error(ErrorKind kind, ErrorDetails details)
    : std::runtime_error(format_error(details)), kind_(kind), details_(std::move(details)) {}

}  // namespace kinespace
