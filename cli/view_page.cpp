#include "cli/view_page.h"

#include <fmt/format.h>

namespace kinespace::cli {
namespace {

constexpr std::string_view place_of_data = "<!--kinespace-data-->";

// '<' stands in strings alone, where an escape means the same.
void append_json(std::string_view json, std::string& out) {
  for (const char c : json) {
    if (c == '<') {
      out += "\\u003c";
    } else {
      out += c;
    }
  }
}

}  // namespace

std::string filled_page(std::string_view page, const ViewData& data) {
  const std::size_t at = page.find(place_of_data);
  std::string out(page.substr(0, at));
  out.reserve(page.size() + data.bytes() + data.bytes() / 64);
  out += R"(<script type="application/json" id="overview">)";
  append_json(data.overview, out);
  out += "</script>\n";
  for (const ViewData::Motion& motion : data.motions) {
    out += fmt::format(R"(<script type="application/json" id="motion-{}">)", motion.clip);
    append_json(motion.json, out);
    out += "</script>\n";
  }
  if (at != std::string_view::npos) out += page.substr(at + place_of_data.size());
  return out;
}

}  // namespace kinespace::cli
