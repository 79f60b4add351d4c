#include <filesystem>
#include <memory>

#include "cli/commands.h"
#include "cli/json_output.h"
#include "motion/error_measures.h"
#include "motion/read.h"

namespace kinespace::cli {
namespace {

struct CompareOptions {
  std::filesystem::path reference;
  std::filesystem::path other;
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

void run_compare(const CompareOptions& options) {
  const Clip reference = read_clip(options.reference);
  Session::check_stop();
  const Clip other = read_clip(options.other);
  Session::check_stop();
  const Json result = to_json(compare(reference, other));
  options.json ? print_json(result) : print_fields(result);
}

}  // namespace

void add_compare(CLI::App& app, Session& /*session*/) {
  CLI::App* command = app.add_subcommand("compare", "How far clip B is from the reference clip A");
  const auto options = std::make_shared<CompareOptions>();
  command->add_option("A", options->reference, "The reference: .bvh or .amc")->required();
  command->add_option("B", options->other, "The clip to judge; joints are matched by name")->required();
  command->add_flag("--json", options->json, "Print the measures as one JSON object");
  command->callback([options] { run_compare(*options); });
}

}  // namespace kinespace::cli
