// The subcommands. A new one is a file cli/NAME_command.cpp that defines add_NAME, and NAME in the list of
// cli/CMakeLists.txt, from which the build makes this list.
#pragma once

#include <CLI/CLI.hpp>

#include "cli/session.h"

namespace kinespace::cli {

// Adds one subcommand with its options and a callback that does its work. The callback throws kinespace::Error, and
// never calls exit(); `session` outlives the parse.
#define KINESPACE_COMMAND(name) void add_##name(CLI::App& app, Session& session);
#include "cli/command_list.inc"
#undef KINESPACE_COMMAND

inline void add_all_commands(CLI::App& app, Session& session) {
#define KINESPACE_COMMAND(name) add_##name(app, session);
#include "cli/command_list.inc"
#undef KINESPACE_COMMAND
}

}  // namespace kinespace::cli
