#include "cli/json_output.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "cli/output.h"
#include "kinespace/base/printable.h"

namespace kinespace::cli {
namespace {

// Six digits; a share that is nearly 1 has as many as tell it from 1.
std::string number_for_people(double value) {
  std::string out = fmt::format("{:.6g}", value);
  if (out == "1" && value < 1 - 1e-12)
    out = fmt::format("{:.{}f}", value, static_cast<int>(-std::log10(1 - value)) + 1);
  return out;
}

std::string shown(const Json& value) {
  if (value.is_string()) return printable(value.get_ref<const std::string&>());
  if (value.is_null()) return "-";
  if (value.is_number_float()) return number_for_people(value.get<double>());
  if (value.is_array()) return std::to_string(value.size());
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// What a terminal obeys and JSON lets stand as it is (DEL, C1 controls, marks of direction) as JSON's escapes: the
// names are the true ones. Such characters are in strings only.
std::string escaped(std::string_view json) {
  std::string out;
  out.reserve(json.size());
  while (!json.empty()) {
    const CharacterOfText next = first_character(json);
    if (next.obeyed && next.code != '\n') {
      out += fmt::format("\\u{:04x}", next.code);
    } else {
      out += json.substr(0, next.bytes);
    }
    json.remove_prefix(next.bytes);
  }
  return out;
}

}  // namespace

void print_json(const Json& object) {
  print("{}\n", escaped(object.dump(2, ' ', false, Json::error_handler_t::replace)));
}

void print_fields(const Json& object) {
  std::vector<std::pair<std::string, std::string>> lines;
  const auto add = [&](std::string name, const Json& value) {
    std::ranges::replace(name, '_', ' ');
    lines.emplace_back(std::move(name), shown(value));
  };
  for (const auto& [key, value] : object.items()) {
    if (!value.is_object()) {
      add(key, value);
      continue;
    }
    for (const auto& [inner, of_inner] : value.items()) add(key + ": " + inner, of_inner);
  }
  std::size_t width = 0;
  for (const auto& [name, value] : lines) width = std::max(width, name.size());
  for (const auto& [name, value] : lines) print("{:<{}}  {}\n", name, width, value);
}

}  // namespace kinespace::cli
