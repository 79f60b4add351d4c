#include "kinespace/base/file_kind.h"

#include <algorithm>
#include <array>

namespace kinespace {
namespace {

struct Beginning {
  std::string_view bytes;
  FileKind kind;
};

using namespace std::string_view_literals;

constexpr std::array beginnings = {
    Beginning{"SQLite format 3\0"sv, FileKind::database},
    Beginning{"\x8bKSB"sv, FileKind::stream},
    Beginning{"glTF"sv, FileKind::glb},
    Beginning{"\x89PNG\r\n\x1a\n"sv, FileKind::png},
    Beginning{"\x93NUMPY"sv, FileKind::numpy},
    Beginning{"ply\n"sv, FileKind::ply},
    Beginning{"ply\r"sv, FileKind::ply},
    Beginning{"<svg"sv, FileKind::svg},
    Beginning{"<?xml"sv, FileKind::svg},
    Beginning{"<!doctype html>"sv, FileKind::html},
};

// The words with which the first line of a text that is no comment begins.
constexpr std::array first_words = {
    Beginning{"hierarchy", FileKind::bvh}, Beginning{":fully-specified", FileKind::amc},
    Beginning{":degrees", FileKind::amc},  Beginning{":radians", FileKind::amc},
    Beginning{":version", FileKind::asf},  Beginning{":name", FileKind::asf},
    Beginning{":units", FileKind::asf},    Beginning{"v", FileKind::obj},
    Beginning{"o", FileKind::obj},         Beginning{"g", FileKind::obj},
    Beginning{"vn", FileKind::obj},        Beginning{"vt", FileKind::obj},
    Beginning{"mtllib", FileKind::obj},    Beginning{"usemtl", FileKind::obj},
};

bool is_white(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

// Behind a byte order mark, white space and lines of comment.
std::string_view from_first_word(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  for (;;) {
    while (!text.empty() && is_white(text.front())) text.remove_prefix(1);
    if (!text.starts_with('#')) return text;
    text.remove_prefix(std::min(text.find('\n'), text.size()));
  }
}

FileKind kind_of_text(std::string_view text) {
  text = from_first_word(text);
  if (text.starts_with('{') || text.starts_with('[')) return FileKind::json;
  const auto end = std::ranges::find_if(text, is_white);
  const std::string_view word(text.begin(), end);
  for (const Beginning& known : first_words) {
    if (std::ranges::equal(word, known.bytes, {}, lower)) return known.kind;
  }
  return FileKind::other;
}

}  // namespace

FileKind file_kind(std::span<const std::byte> start) {
  if (start.empty()) return FileKind::empty;
  const std::string_view text(reinterpret_cast<const char*>(start.data()), std::min(start.size(), file_kind_bytes));
  for (const Beginning& known : beginnings) {
    if (text.starts_with(known.bytes)) return known.kind;
  }
  return kind_of_text(text);
}

std::string_view describe(FileKind kind) {
  switch (kind) {
    case FileKind::empty:
      return "an empty file";
    case FileKind::database:
      return "a library";
    case FileKind::stream:
      return "a compressed stream";
    case FileKind::bvh:
      return "a BVH motion";
    case FileKind::asf:
      return "an ASF skeleton";
    case FileKind::amc:
      return "an AMC motion";
    case FileKind::glb:
      return "a binary glTF file";
    case FileKind::json:
      return "a JSON file";
    case FileKind::svg:
      return "an SVG picture";
    case FileKind::png:
      return "a PNG picture";
    case FileKind::html:
      return "a page (HTML)";
    case FileKind::numpy:
      return "a NumPy array";
    case FileKind::obj:
      return "an OBJ mesh";
    case FileKind::ply:
      return "a PLY mesh";
    case FileKind::other:
      break;
  }
  return "a file of no kind that is known here";
}

}  // namespace kinespace
