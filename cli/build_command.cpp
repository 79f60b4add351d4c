#include <chrono>
#include <filesystem>
#include <memory>
#include <vector>

#include <fmt/format.h>

#include "cli/bad_files.h"
#include "cli/commands.h"
#include "cli/device_choice.h"
#include "cli/json_output.h"
#include "cli/option_checks.h"
#include "cli/stage_log.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/file_formats.h"

namespace kinespace::cli {
namespace {

struct BuildOptions {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path output;
  LibraryBuilderOptions library;
  std::string asf;
  std::string grouping = "all";
  int functions = 0;
  std::string device = "auto";
  bool no_align = false;
  bool skip_bad = false;
  bool json = false;
};

Json to_json(const LibraryReport& report, const std::filesystem::path& output, double seconds) {
  return {{"library", output.string()},
          {"clips", report.clips},
          {"added", report.added},
          {"bad_files", to_json(BadFiles(report.bad))},
          {"unchanged", report.unchanged},
          {"resumed", report.resumed},
          {"sequences", report.sequences},
          {"spaces", report.spaces},
          {"functions", report.functions},
          {"all_functions", report.all_functions},
          {"variance", report.variance},
          {"movement", report.movement},
          {"mean_joint_error_cm", report.mean_joint_error_cm},
          {"max_joint_error_cm", report.max_joint_error_cm},
          {"frames", report.frames},
          {"cycles", report.cycles},
          {"cyclic_share", report.seconds > 0 ? report.cyclic_seconds / report.seconds : 0},
          {"warped", report.warped},
          {"bytes", report.bytes},
          {"seconds", seconds}};
}

Grouping grouping_of(const std::string& name) {
  if (name == "component") return Grouping::per_component;
  if (name == "joint") return Grouping::per_joint_component;
  return Grouping::all_together;
}

// A build that is stopped keeps what it has read.
std::string what_a_stopped_build_leaves(const std::filesystem::path& output) {
  const std::string partial = output.string() + ".partial";
  std::error_code ignored;
  if (!std::filesystem::exists(partial, ignored)) return "stopped; nothing half-written is left";
  return fmt::format(
      "stopped; {} is as it was, and {} keeps the clips that were read: the same command goes on from there",
      output.string(), partial);
}

void run_build(BuildOptions options, Session& session) {
  const auto start = std::chrono::steady_clock::now();
  LibraryBuilderOptions& library = options.library;
  library.space.align = !options.no_align;
  library.space.sequences.equal_windows = options.no_align;
  library.space.space.grouping = grouping_of(options.grouping);
  if (options.functions > 0) library.space.space.functions = options.functions;
  if (!options.asf.empty()) library.asf = options.asf;
  library.leave_out_bad = true;
  const auto files = find_motion_files(options.inputs);
  session.detail(fmt::format("{} motion files", files.size()));
  const Compute compute = open_device(options.device, session, files.size());
  StageLog stages(compute);
  session.when_stopped = [output = options.output] { return what_a_stopped_build_leaves(output); };
  const LibraryReport report = build_library(files, options.output, library, compute, stages.watch(session.progress()));
  session.finish_progress();
  for (const std::string& note : report.notes) session.note(note);
  for (const std::string& doubt : report.doubts) session.note(doubt);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  Json result = to_json(report, options.output, elapsed.count());
  if (!options.json) print_fields(result);
  stages.finish(result, session);
  if (options.json) print_json(result);
  BadFiles(report.bad).tell(options.skip_bad, session);
}

}  // namespace

void add_build(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("build", "Make a motion-space library of clips");
  const auto options = std::make_shared<BuildOptions>();
  LibraryBuilderOptions& library = options->library;
  command
      ->add_option("CLIPS", options->inputs,
                   fmt::format("Clips ({}), or folders with clips anywhere below them", listed(clip_endings_read())))
      ->required();
  command->add_option("-o,--output", options->output, "The library to make, LIB.kspace")->required();
  command->add_flag("--add", library.add,
                    "Add to the library that is there instead of replacing it; it keeps the choices it was made with");
  command->add_flag("--by-skeleton", library.by_skeleton, "One space for each joint tree, where clips have several");
  command->add_option("--asf", options->asf, "The skeleton of the .amc clips (else found beside each)");
  command->add_option("--variance", library.space.space.variance_share, "Share of variance the functions must cover")
      ->capture_default_str();
  command->add_option("--functions", options->functions, "This many functions instead")->check(number_above_zero());
  command
      ->add_option("--points", library.space.space.points, "Points of a sequence's time grid (0: from the frame rate)")
      ->capture_default_str();
  command->add_option("--grouping", options->grouping, "Which curves share functions: all, component or joint")
      ->check(CLI::IsMember({"all", "component", "joint"}))
      ->capture_default_str();
  command->add_flag("--smooth", library.space.space.smooth,
                    "Smooth mean and covariance, and keep what scores are expected to be without the noise (PACE)");
  command
      ->add_option("--cycles", library.space.sequences.most_cycles,
                   "Most cycles of a walk or the like in a sequence (0: cut all motion at rests)")
      ->check(CLI::Range(0, 8))
      ->capture_default_str();
  command->add_flag("--no-align", options->no_align,
                    "As many sequences, but of equal length at any phase, and no warps: what registration is worth");
  add_skip_bad(command, options->skip_bad);
  add_device_option(command, options->device);
  command->add_flag("--json", options->json, "Print the result as one JSON object");
  session.files.reads(command, {"CLIPS", "--asf"});
  session.files.writes(command, {"--output"}, FileKind::database);
  command->callback([options, &session] { run_build(*options, session); });
}

}  // namespace kinespace::cli
