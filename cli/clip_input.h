// Clips that a command reads from files that the user names.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/session.h"
#include "kinespace/motion/clip.h"
#include "kinespace/motion/read_options.h"

namespace kinespace::cli {

// What is to be read of the file, where it leaves a choice.
struct ClipChoice {
  std::optional<std::filesystem::path> asf;  // of an .amc
  std::string animation;                     // of a file with several
  bool strict = false;
  std::optional<double> rate_hz;
};

// Frames that a file has not.
struct LostFrames {
  int first = 0, last = 0;  // both included
};

// --animation, --strict, --rate
void add_clip_choice(CLI::App* command, ClipChoice& choice);

// Reads a clip, and notes what its reader chose or passed over.
[[nodiscard]] Clip read_input(const std::filesystem::path& file, const ClipChoice& choice, Session& session,
                              std::vector<LostFrames>* lost = nullptr);

}  // namespace kinespace::cli
