// `info --repeats`: which stretches of clips repeat others.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "cli/session.h"

namespace kinespace::cli {

struct RepeatReportOptions {
  std::vector<std::filesystem::path> files;      // clips of one skeleton and rate
  std::optional<std::filesystem::path> picture;  // an SVG to write
  bool json = false;
};

// Reads the clips and prints primary clips with their repetitions. Throws Error.
void report_repeats(const RepeatReportOptions& options, Session& session);

}  // namespace kinespace::cli
