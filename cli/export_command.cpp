#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/json_output.h"
#include "kinespace/base/file.h"
#include "kinespace/library/library_view.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"

namespace kinespace::cli {
namespace {

struct ExportOptions {
  std::filesystem::path library;
  std::string clip;
  std::filesystem::path output;
  std::optional<int> functions;
  std::optional<double> max_error_cm;
  bool json = false;
};

// Of the level that is played, or of the nearest coarser one that was measured.
void add_measured_error(const EncodedClip& clip, int level, Json& result) {
  const LevelError* known = nullptr;
  for (const LevelError& l : clip.levels) {
    if (l.level <= level) known = &l;
  }
  result["mean_joint_error_cm"] = known ? Json(known->error.mean_joint_error_cm) : Json();
  result["max_joint_error_cm"] = known ? Json(known->error.max_joint_error_cm) : Json();
  if (known && known->level != level) result["errors_of_level"] = known->level;
}

void run_export(const ExportOptions& options, Session& session) {
  static_cast<void>(files_written(options.output));  // an ending that cannot be written is told before the work
  LibraryView library(options.library);
  const ClipRow row = library.require_clip(options.clip);
  const RegisteredSpace& space = library.space(row.space_id);
  int functions = space.levels();
  if (options.functions) functions = std::min(*options.functions, functions);
  std::optional<LibraryView::LevelOfDetail> level;
  if (options.max_error_cm) {
    level = library.level_for_error(row, *options.max_error_cm);
    functions = level->functions;
    if (!level->from_the_file) {
      session.note(
          "the file that the clip came from is not there unchanged: its error is that measured when the library "
          "was built, or never less");
    }
  }
  const EncodedClip encoded = library.encoded(row);
  const Skeleton& skeleton = library.skeleton(row.skeleton_id);
  write_clip(options.output, clip_from_curves(decode(space, encoded, functions), skeleton));
  Json result{{"clip", row.name},
              {"output", options.output.string()},
              {"frames", row.frames},
              {"functions", functions},
              {"of_functions", space.levels()}};
  if (level) {
    result["max_joint_error_cm"] = level->max_error_cm;
  } else {
    add_measured_error(encoded, functions, result);
  }
  options.json ? print_json(result) : print_fields(result);
}

}  // namespace

void add_export(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("export", "Play a clip of a library into a file, at any level of detail");
  const auto options = std::make_shared<ExportOptions>();
  command->add_option("LIB", options->library, "The library")->required();
  command->add_option("CLIP", options->clip, "The clip's name")->required();
  command->add_option("-o,--output", options->output, "The file to write: " + listed(clip_endings_written()))
      ->required();
  CLI::Option* lod =
      command->add_option("--lod", options->functions, "Use only the first N functions")->check(CLI::NonNegativeNumber);
  command
      ->add_option("--max-error", options->max_error_cm,
                   "The fewest functions with every joint this near to the clip as it was read, in cm")
      ->check(CLI::NonNegativeNumber)
      ->excludes(lod);
  command->add_flag("--json", options->json, "Print what was written as one JSON object");
  session.files.reads(command, {"LIB"});
  session.files.writes(command, {"--output"});
  command->callback([options, &session] { run_export(*options, session); });
}

}  // namespace kinespace::cli
