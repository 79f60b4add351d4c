// What the subcommands that make motions share: the file, the picture, and foot-skate cleanup.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "cli/json_output.h"
#include "cli/session.h"
#include "kinespace/motion/clip.h"
#include "kinespace/motion/strip.h"

namespace kinespace::cli {

struct SynthesisOutput {
  std::filesystem::path file;
  std::optional<std::filesystem::path> picture;
  bool clean_feet = false;
  bool strict = false;  // a cleanup that makes things worse is an error, and nothing is written
  bool json = false;
};

// Cleans the feet when asked, writes the motion and the picture, and adds to `result`: output, frames, duration_s,
// rate_hz, feet (foot_figures.h), and what the cleanup did. `bands`: what to mark in the picture.
void write_synthesis(const SynthesisOutput& output, Clip clip, const std::vector<StripBand>& bands, Json& result,
                     Session& session);

}  // namespace kinespace::cli
