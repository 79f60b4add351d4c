#include "cli/clip_input.h"

#include "kinespace/motion/read.h"

namespace kinespace::cli {

void add_clip_choice(CLI::App* command, ClipChoice& choice) {
  command->add_option("--animation", choice.animation,
                      "Of a file with several clips this one, by its name or its number from 1");
  command->add_flag("--strict", choice.strict,
                    "Refuse a BVH or AMC file that needs mending: a frame count that is wrong, lost frames");
  command
      ->add_option("--rate", choice.rate_hz,
                   "Frames a second: of BVH and AMC whatever the file says, of glTF to sample it at")
      ->check(CLI::Range(1e-6, 1e6));
}

Clip read_input(const std::filesystem::path& file, const ClipChoice& choice, Session& session,
                std::vector<LostFrames>* lost) {
  ClipReadOptions options{.companion = choice.asf,
                          .animation = choice.animation,
                          .strict = choice.strict,
                          .rate_hz = choice.rate_hz,
                          .note = [&](const std::string& what) { session.note(what); }};
  if (lost != nullptr) options.lost = [lost](int first, int last) { lost->push_back({first, last}); };
  return read_clip(file, options);
}

}  // namespace kinespace::cli
