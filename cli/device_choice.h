// The --device option of subcommands that compute.
#pragma once

#include <cstddef>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/session.h"
#include "kinespace/kernels/device.h"

namespace kinespace::cli {

void add_device_option(CLI::App* command, std::string& choice);

// What the option names; "auto" goes by what was measured on this machine (`devices --calibrate`). For a build of more
// than 1 000 clips under "auto" it is measured now when that was not done yet, and kept; what goes wrong with the cache
// is noted and costs no more than that.
[[nodiscard]] Compute open_device(const std::string& choice, Session& session, std::size_t clips = 0);

}  // namespace kinespace::cli
