#include <filesystem>
#include <memory>
#include <optional>

#include "cli/commands.h"
#include "cli/json_output.h"
#include "cli/option_checks.h"
#include "cli/synthesis_output.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"
#include "kinespace/synthesis/interpolation.h"

namespace kinespace::cli {
namespace {

struct BlendCommandOptions {
  std::filesystem::path library;
  std::vector<std::string> clips;
  std::vector<double> weights;
  std::optional<int> functions;
  BlendOptions blend;
  SynthesisOutput output;
};

void run_blend(BlendCommandOptions options, Session& session) {
  static_cast<void>(files_written(options.output.file));  // an ending that cannot be written is told before the work
  if (!options.weights.empty()) options.blend.weights = options.weights;
  options.blend.functions = options.functions.value_or(-1);
  LibraryView library(options.library);
  const Blend blend = make_blend(library, options.clips, options.blend);
  Json result{{"clips", options.clips},
              {"controls", blend.controls},
              {"scale", blend.scale},
              {"shift_s", 0.0},
              {"cost", blend.cost_cm},
              {"seam_speed_ratio", blend.ratios.speed},
              {"seam_acceleration_ratio", blend.ratios.acceleration}};
  write_synthesis(options.output, blend.clip, {}, result, session);
  options.output.json ? print_json(result) : print_fields(result);
}

}  // namespace

void add_blend(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("blend", "Interpolate motions: a Bezier curve through clips, or weights");
  const auto options = std::make_shared<BlendCommandOptions>();
  command->add_option("LIB", options->library, "The library")->required();
  command->add_option("CLIP", options->clips, "Clips, in the order the curve passes through them")->required();
  command->add_option("-o,--output", options->output.file, "The file to write: " + listed(clip_endings_written()))
      ->required();
  CLI::Option* weights =
      command->add_option("--weights", options->weights, "A plain blend: one weight a clip")->delimiter(',');
  command->add_option("--at", options->blend.at, "One point of the curve: 0 is the first clip, 1 the second, ..")
      ->excludes(weights);
  command
      ->add_option("--neighbours", options->blend.neighbours,
                   "Near motions of each clip that may be control points; 0: none")
      ->capture_default_str();
  command->add_option("--lod", options->functions, "Use only the first N functions")->check(number_from_zero());
  command->add_flag("--clean-feet", options->output.clean_feet, "Take foot skate out of the result");
  command->add_flag("--strict", options->output.strict, "With --clean-feet: feet that get worse are an error");
  command->add_option("--picture", options->output.picture, "Also write stick figures, .svg");
  command->add_flag("--json", options->output.json, "Print the figures as one JSON object");
  session.files.reads(command, {"LIB"});
  session.files.writes(command, {"--output"});
  session.files.writes(command, {"--picture"}, FileKind::svg);
  command->callback([options, &session] { run_blend(*options, session); });
}

}  // namespace kinespace::cli
