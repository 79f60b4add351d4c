#include "base/error.h"

#include <utility>

namespace kinespace {
namespace {

// File contents end up in messages; a terminal must not obey them.
std::string printable(const std::string& text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += '?';
    } else {
      out += c;
    }
  }
  constexpr std::size_t longest = 300;
  if (out.size() > longest) out = out.substr(0, longest) + "...";
  return out;
}

}  // namespace

std::string format_error(const ErrorDetails& details) {
  std::string out;
  if (!details.file.empty()) {
    out += printable(details.file);
    if (details.line > 0) out += ":" + std::to_string(details.line);
    out += ": ";
  }
  if (!details.found.empty()) out += printable(details.found);
  if (!details.expected.empty()) {
    out += details.found.empty() ? "expected " : ", expected ";
    out += printable(details.expected);
  }
  if (!details.remedy.empty()) out += "; " + printable(details.remedy);
  return out;
}

Error::Error(ErrorKind kind, ErrorDetails details)
    : std::runtime_error(format_error(details)), kind_(kind), details_(std::move(details)) {}

}  // namespace kinespace
