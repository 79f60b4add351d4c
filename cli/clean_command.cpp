#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "cli/clip_input.h"
#include "cli/commands.h"
#include "cli/foot_figures.h"
#include "cli/json_output.h"
#include "kinespace/base/file.h"
#include "kinespace/footskate/cleanup.h"
#include "kinespace/footskate/contact_labels.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"
#include "kinespace/motion/strip.h"

namespace kinespace::cli {
namespace {

struct CleanCommandOptions {
  std::filesystem::path input;
  ClipChoice choice;
  std::filesystem::path output;
  std::string feet;
  std::optional<double> floor_cm;
  std::optional<std::filesystem::path> library;
  std::optional<std::filesystem::path> picture;
  bool json = false;
};

void write_picture(const std::filesystem::path& path, const Clip& before, const CleanResult& result) {
  StripOptions strip{.floor_cm = result.report.ground.height_cm, .clip_label = "clean", .ghost = &before};
  const auto joints = result.report.feet.foot_joints();
  for (const Plant& plant : result.report.plants) {
    strip.marks.push_back({.joint = joints[plant.contact.slot],
                           .first_frame = plant.contact.first_frame,
                           .last_frame = plant.contact.last_frame,
                           .position_cm = plant.place});
  }
  write_strip(path, result.clip, strip);
}

Json to_json(const CleanCommandOptions& options, const CleanResult& result) {
  const CleanReport& r = result.report;
  const auto& joints = result.clip.skeleton.joints;
  return {{"output", options.output.string()},
          {"frames", result.clip.frames},
          {"plants", r.plants.size()},
          {"foot_slide_before_cm_s", or_null(r.foot_slide_before_cm_s)},
          {"foot_slide_after_cm_s", or_null(r.foot_slide_after_cm_s)},
          {"floor_penetration_cm", r.floor_penetration_cm},
          {"feet_before", foot_figures(r.feet_before)},
          {"feet_after", foot_figures(r.feet_after)},
          {"mean_pose_change_cm", r.mean_pose_change_cm},
          {"acceleration_ratio", r.acceleration_ratio},
          {"ground", to_string(r.ground.kind)},
          {"floor_cm", r.ground.height_cm},
          {"left_ankle", joints[r.feet.legs[0].ankle].name},
          {"right_ankle", joints[r.feet.legs[1].ankle].name}};
}

void run_clean(const CleanCommandOptions& options, Session& session) {
  static_cast<void>(files_written(options.output));  // an ending that cannot be written is told before the work
  CleanOptions clean_options{.feet = options.feet.empty() ? FeetNames{} : FeetNames::parse(options.feet),
                             .floor_cm = options.floor_cm};
  std::optional<ContactModel> model;
  if (options.library) {
    model = library_contact_model(Library::open_read_only(*options.library));
    if (!model) session.note("the library has no contact labels: the standard model decides");
  }
  if (model) clean_options.model = &*model;
  Clip clip = read_input(options.input, options.choice, session);
  session.note_doubts(clip);
  Session::check_stop();
  std::optional<Clip> before;
  if (options.picture) before = clip;
  const CleanResult result = clean(std::move(clip), clean_options);
  Session::check_stop();
  session.doubt_result(doubts_about(result.report), options.choice.strict);
  write_clip(options.output, result.clip);
  if (options.picture) write_picture(*options.picture, *before, result);
  const Json out = to_json(options, result);
  options.json ? print_json(out) : print_fields(out);
}

}  // namespace

void add_clean(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("clean", "Take foot skate out: feet that stand stay where they stand");
  const auto options = std::make_shared<CleanCommandOptions>();
  command->add_option("IN", options->input, "The clip: " + listed(clip_endings_read()))->required();
  command->add_option("-o,--output", options->output, "The file to write: " + listed(clip_endings_written()))
      ->required();
  add_clip_choice(command, options->choice);
  command->get_option("--strict")
      ->description("Refuse a file that needs mending, and a result that is worse than its input: nothing is written");
  command->add_option("--feet", options->feet, "The ankle joints as LEFT,RIGHT; found by name and shape otherwise");
  command->add_option("--floor", options->floor_cm, "The floor is flat at this height in cm; estimated otherwise");
  command->add_option("--library", options->library, "Use the contact labels of this library (kinespace contacts)");
  command->add_option("--picture", options->picture, "Also write stick figures with the plants marked, .svg");
  command->add_flag("--json", options->json, "Print the figures as one JSON object");
  session.files.reads(command, {"IN", "--library"});
  session.files.writes(command, {"--output"});
  session.files.writes(command, {"--picture"}, FileKind::svg);
  command->callback([options, &session] { run_clean(*options, session); });
}

}  // namespace kinespace::cli
