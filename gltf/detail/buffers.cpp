#include "kinespace/gltf/detail/buffers.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <system_error>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/gltf/detail/base64.h"

namespace kinespace::gltf {
namespace {

namespace fs = std::filesystem;

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

// "http:", "file:" and a drive's letter alike (RFC 3986, section 3.1).
bool has_scheme(std::string_view uri) {
  if (uri.empty() || !is_letter(uri[0])) return false;
  const std::size_t end =
      std::find_if_not(
          uri.begin(), uri.end(),
          [](char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.'; }) -
      uri.begin();
  return end < uri.size() && uri[end] == ':';
}

std::string percent_decoded(std::string_view uri) {
  std::string out;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned value = 0;
    const bool two_digits = uri[i] == '%' && i + 2 < uri.size() &&
                            std::from_chars(&uri[i + 1], &uri[i + 1] + 2, value, 16).ptr == &uri[i + 1] + 2;
    out += two_digits ? static_cast<char>(value) : uri[i];
    if (two_digits) i += 2;
  }
  return out;
}

// For messages: a name may be as long as the file.
std::string shown(std::string_view uri) {
  constexpr std::size_t most = 80;
  return fmt::format("{}{}", uri.substr(0, most), uri.size() > most ? "..." : "");
}

bool is_below(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

}  // namespace

void BufferSource::fail(std::string found, std::string expected, std::string remedy) const {
  throw Error(ErrorKind::bad_input, {.file = file_.string(),
                                     .found = std::move(found),
                                     .expected = std::move(expected),
                                     .remedy = std::move(remedy)});
}

std::vector<unsigned char> BufferSource::decoded(std::string_view uri, std::uint64_t length) const {
  const std::size_t comma = uri.find(',');
  if (comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64")) {
    fail("a buffer at " + shown(uri), "a data URI in base64");
  }
  auto bytes = decode_base64(uri.substr(comma + 1));
  if (!bytes) fail("a buffer whose data is not base64", "letters, digits, + and /");
  if (bytes->size() < length) {
    fail(fmt::format("a buffer of {} bytes", bytes->size()), fmt::format("the {} it is said to have", length));
  }
  bytes->resize(length);
  return *std::move(bytes);
}

fs::path BufferSource::beside(const std::string& uri) const {
  const fs::path name = percent_decoded(uri);
  const std::string expected = "a file in the folder of the .gltf file";
  const bool up = std::find(name.begin(), name.end(), "..") != name.end();
  if (has_scheme(uri) || name.empty() || name.is_absolute() || up || name.string().find('\0') != std::string::npos) {
    fail(fmt::format("a buffer at '{}'", shown(uri)), expected, "copy the buffer there and name it alone");
  }
  std::error_code code;
  const fs::path folder = fs::canonical(file_.has_parent_path() ? file_.parent_path() : fs::path("."), code);
  const fs::path target = code ? fs::path() : fs::canonical(folder / name, code);
  if (code) {
    fail(fmt::format("no file '{}' beside it ({})", shown(name.string()), code.message()), "the buffer that it names",
         "copy the buffer into the same folder");
  }
  if (!is_below(target, folder)) {
    fail(fmt::format("a buffer '{}' that is a link out of the folder", shown(name.string())), expected,
         "copy the buffer there");
  }
  return target;
}

std::vector<unsigned char> BufferSource::read(const std::string& uri, std::uint64_t length) {
  if (uri.starts_with("data:")) {
    // Decoded whole first, in a copy that is as large as the text allows.
    budget_.take("buffers", 1, std::max<std::uint64_t>(length, uri.size() / 4 * 3));
    return decoded(uri, length);
  }
  const FileContent& file = content_of(beside(uri));
  if (file.bytes().size() < length) {
    throw Error(ErrorKind::bad_input, {.file = last_path_.string(),
                                       .found = fmt::format("{} bytes", file.bytes().size()),
                                       .expected = fmt::format("the {} that {} wants", length, file_.string()),
                                       .remedy = "copy the buffer whole"});
  }
  budget_.take("buffers", 1, length);
  const std::string_view text = file.text().substr(0, length);
  return {text.begin(), text.end()};
}

const FileContent& BufferSource::content_of(fs::path path) {
  if (last_ && path == last_path_) return *last_;
  last_.reset();
  FileContent content(path);
  if (std::find(known_.begin(), known_.end(), path) == known_.end()) {
    known_.push_back(path);
    budget_.add_file(content.bytes().size());
  }
  budget_.take("files beside it", 1, content.bytes().size());
  last_path_ = std::move(path);
  return last_.emplace(std::move(content));
}

}  // namespace kinespace::gltf
