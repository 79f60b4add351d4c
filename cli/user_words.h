// What went wrong with a command line, in the words of whoever typed it. The library names the fields of its options
// ("CodecTarget::mean_error_cm = 0"), as a programmer needs; here they become the options of the command ("--error 0"),
// and words that are no subcommand are told from those that are.
#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "kinespace/base/error.h"

namespace kinespace::cli {

// The message of an error that came out of the subcommand that `app` parsed.
[[nodiscard]] std::string in_users_words(const CLI::App& app, const Error& error);

// What was typed where a subcommand belongs and is none, and the nearest that is one; nullopt when that is not what is
// wrong with the line.
[[nodiscard]] std::optional<std::string> mistyped_subcommand(const CLI::App& app, int argc, const char* const* argv);

}  // namespace kinespace::cli
