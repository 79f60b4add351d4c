// The page that `kinespace view` fills: one HTML file with all that it needs, made of viewer/ by the build.
#pragma once

#include <string>
#include <string_view>

#include "cli/view_data.h"

namespace kinespace::cli {

// The page without data; empty in a build without Node (viewer/CMakeLists.txt).
[[nodiscard]] std::string_view empty_page();

// The page with data: one script element of JSON for the overview and one for each clip. Nothing in them can end the
// element or begin another, whatever names there are.
[[nodiscard]] std::string filled_page(std::string_view page, const ViewData& data);

}  // namespace kinespace::cli
