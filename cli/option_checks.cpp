#include "cli/option_checks.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <system_error>

#include <fmt/format.h>

namespace kinespace::cli {
namespace {

std::optional<double> finite_number(const std::string& text) {
  const char* end = text.data() + text.size();
  double value = 0;
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

CLI::Validator number_from_zero() {
  const auto check = [](const std::string& text) {
    const auto value = finite_number(text);
    return value && *value >= 0 ? std::string() : fmt::format("{}, expected a number, 0 or more", text);
  };
  return CLI::Validator("0 or more").operation(check);
}

CLI::Validator number_above_zero() {
  const auto check = [](const std::string& text) {
    const auto value = finite_number(text);
    return value && *value > 0 ? std::string() : fmt::format("{}, expected a number above 0", text);
  };
  return CLI::Validator("above 0").operation(check);
}

}  // namespace kinespace::cli
