#include <filesystem>
#include <memory>

#include "cli/clip_input.h"
#include "cli/commands.h"
#include "cli/foot_figures.h"
#include "cli/json_output.h"
#include "kinespace/footskate/skate_measures.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"

namespace kinespace::cli {
namespace {

struct CompareOptions {
  std::filesystem::path reference;
  std::filesystem::path other;
  ClipChoice choice, other_choice;
  bool json = false;
};

Json to_json(const MotionError& error) {
  return {{"joints", error.joints},
          {"frames", error.frames},
          {"mean_joint_error_cm", error.mean_joint_error_cm},
          {"max_joint_error_cm", error.max_joint_error_cm},
          {"shell_error_cm", error.shell_error_cm},
          {"mean_rotation_error_deg", error.mean_rotation_error_deg},
          {"kg", error.kg},
          {"kg_time", error.kg_time},
          {"channel_mse_deg2", error.channel_mse_deg2}};
}

// The figures of the feet, null where no feet can be told.
void add_skate(Json& result, const Clip& reference, const Clip& other, Session& session) {
  const auto skate = compare_skate(reference, other);
  if (!skate) {
    session.note("no feet found: foot_slide_cm_s and floor_penetration_cm are not known");
  } else if (!skate->foot_slide_cm_s) {
    session.note("no foot of the reference stands: foot_slide_cm_s is not known");
  }
  result["foot_slide_cm_s"] = skate ? or_null(skate->foot_slide_cm_s) : Json(nullptr);
  result["floor_penetration_cm"] = skate ? Json(skate->floor_penetration_cm) : Json(nullptr);
  result["feet_of_a"] = foot_figures(skate ? std::optional(skate->of_a) : std::nullopt);
  result["feet_of_b"] = foot_figures(skate ? std::optional(skate->of_b) : std::nullopt);
}

void run_compare(const CompareOptions& options, Session& session) {
  const Clip reference = read_input(options.reference, options.choice, session);
  Session::check_stop();
  const Clip other = read_input(options.other, options.other_choice, session);
  Session::check_stop();
  Json result = to_json(compare(reference, other));
  add_skate(result, reference, other, session);
  options.json ? print_json(result) : print_fields(result);
}

}  // namespace

void add_compare(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("compare", "How far clip B is from the reference clip A");
  const auto options = std::make_shared<CompareOptions>();
  command->add_option("A", options->reference, "The reference: " + listed(clip_endings_read()))->required();
  command->add_option("B", options->other, "The clip to judge; joints are matched by name")->required();
  add_clip_choice(command, options->choice);
  command->add_option("--animation-b", options->other_choice.animation, "The same of clip B; --animation is of A");
  command->add_flag("--json", options->json, "Print the measures as one JSON object");
  session.files.reads(command, {"A", "B"});
  command->callback([options, &session] { run_compare(*options, session); });
}

}  // namespace kinespace::cli
