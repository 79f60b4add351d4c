// Checks of option fields, for messages that name field, value and range. Private to this folder.
#pragma once

#include <cmath>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {

inline void require_option(std::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw Error(ErrorKind::usage, {.found = fmt::format("{} = {}", field, value),
                                 .expected = fmt::format("a number from {} to {}", low, high),
                                 .remedy = fmt::format("choose another {}", field)});
}

}  // namespace kinespace
