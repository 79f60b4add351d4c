// What numbers an option takes, said in words: CLI11's own checks name the largest double, and let NaN pass.
#pragma once

#include <CLI/CLI.hpp>

namespace kinespace::cli {

// Finite and 0 or more.
[[nodiscard]] CLI::Validator number_from_zero();

// Finite and more than 0.
[[nodiscard]] CLI::Validator number_above_zero();

}  // namespace kinespace::cli
