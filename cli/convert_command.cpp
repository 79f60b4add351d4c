#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "cli/clip_input.h"
#include "cli/commands.h"
#include "cli/json_output.h"
#include "kinespace/base/file.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"

namespace kinespace::cli {
namespace {

struct ConvertOptions {
  std::filesystem::path input;
  std::filesystem::path output;
  ClipChoice choice;
  bool json = false;
};

void convert(const ConvertOptions& options, Session& session) {
  static_cast<void>(files_written(options.output));  // an ending that cannot be written is told before the work
  const Clip clip = read_input(options.input, options.choice, session);
  session.note_doubts(clip);
  Session::check_stop();
  write_clip(options.output, clip);
  if (options.json) {
    print_json({{"output", options.output.string()},
                {"frames", clip.frames},
                {"rate_hz", clip.rate_hz},
                {"joints", clip.skeleton.joint_count()}});
  } else {
    session.note(fmt::format("wrote {}: {} frames at {:.6g} Hz, {} joints", options.output.string(), clip.frames,
                             clip.rate_hz, clip.skeleton.joint_count()));
  }
}

}  // namespace

void add_convert(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("convert", "Convert a clip between BVH, ASF/AMC and glTF");
  const auto options = std::make_shared<ConvertOptions>();
  command
      ->add_option("IN", options->input,
                   fmt::format("A {} file; an .amc with its .asf beside it", listed(clip_endings_read())))
      ->required();
  command
      ->add_option("OUT", options->output,
                   fmt::format("Where to: {}; an .amc writes the .asf too", listed(clip_endings_written())))
      ->required();
  command->add_option("--asf", options->choice.asf, "The skeleton of an .amc input");
  add_clip_choice(command, options->choice);
  command->add_flag("--json", options->json, "Print what was written as JSON");
  session.files.reads(command, {"IN", "--asf"});
  session.files.writes(command, {"OUT"});
  command->callback([options, &session] { convert(*options, session); });
}

}  // namespace kinespace::cli
