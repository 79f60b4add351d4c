#include "kinespace/gltf/detail/json_shape.h"

#include <algorithm>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace::gltf {
namespace {

// A value in an array that doubles as it grows, an object or array of its own, a member's node with its key, a string.
constexpr std::uint64_t value_bytes = 32, container_bytes = 64, member_bytes = 112, string_bytes = 48;

// Behind the quote that ends the string whose first quote is at `open`.
std::size_t string_end(std::string_view json, std::size_t open) {
  std::size_t at = open + 1;
  while (at < json.size() && json[at] != '"') at += json[at] == '\\' ? 2 : 1;
  return std::min(at + 1, json.size());
}

}  // namespace

std::uint64_t json_tree_bytes(std::string_view json, const std::string& file) {
  std::uint64_t bytes = value_bytes;
  int depth = 0;
  for (std::size_t at = 0; at < json.size();) {
    switch (json[at]) {
      case '"': {
        const std::size_t end = string_end(json, at);
        bytes += string_bytes + (end - at);
        at = end;
        continue;
      }
      case '[':
      case '{':
        bytes += container_bytes + value_bytes;
        if (++depth > deepest_json) {
          throw Error(ErrorKind::bad_input,
                      {.file = file,
                       .line = 1 + std::count(json.begin(), json.begin() + static_cast<std::ptrdiff_t>(at), '\n'),
                       .found = fmt::format("JSON nested deeper than {} brackets", deepest_json),
                       .expected = "a glTF file, which needs fewer"});
        }
        break;
      case ']':
      case '}':
        --depth;
        break;
      case ',':
        bytes += value_bytes;
        break;
      case ':':
        bytes += member_bytes;
        break;
      default:
        break;
    }
    ++at;
  }
  return bytes;
}

}  // namespace kinespace::gltf
