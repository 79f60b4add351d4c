#include <algorithm>
#include <filesystem>
#include <memory>

#include "cli/commands.h"
#include "cli/foot_figures.h"
#include "cli/json_output.h"
#include "cli/synthesis_output.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"
#include "kinespace/synthesis/transition_plan.h"

namespace kinespace::cli {
namespace {

struct TransitionCommandOptions {
  std::filesystem::path library;
  std::vector<std::string> clips;
  TransitionPlanOptions plan;
  SynthesisOutput output;
};

// Time of the first clip = scale * time of the second + shift, both by the clips' own clocks.
double scale_of(const Connection& connection) {
  return connection.speed();
}
double shift_of(const Connection& connection) {
  return connection.leave_s - connection.speed() * connection.enter_s;
}

Json seam_json(const PlannedTransition& plan, std::size_t i) {
  const Join& join = plan.transition.joins[i];
  return {{"from", plan.pieces[i]},
          {"to", plan.pieces[i + 1]},
          {"scale", scale_of(join.connection)},
          {"shift_s", shift_of(join.connection)},
          {"cost", join.connection.cost_cm},
          {"begin_s", plan.transition.begin[i]},
          {"end_s", plan.transition.begin[i] + join.duration_s},
          {"leave_s", join.connection.leave_s},
          {"enter_s", join.connection.enter_s},
          {"seam_speed_ratio", join.ratios.speed},
          {"seam_acceleration_ratio", join.ratios.acceleration},
          {"seam_root_acceleration_ratio", join.ratios.root_acceleration},
          {"way", to_string(join.way)},
          {"feet_planned", join.feet_planned},
          {"feet", foot_figures(join.feet)},
          {"feet_of_clips", foot_figures(join.feet_of_sources)}};
}

// Of a single seam its figures; of several those of the seam that costs most, and the largest ratios.
Json to_json(const PlannedTransition& plan) {
  Json out{{"clips", plan.clips}, {"found", true}};
  const auto& joins = plan.transition.joins;
  const auto worst = std::ranges::max_element(joins, {}, [](const Join& j) { return j.connection.cost_cm; });
  const auto largest = [&](double SeamRatios::*ratio) {
    double value = 0;
    for (const Join& join : joins) value = std::max(value, join.ratios.*ratio);
    return value;
  };
  out["scale"] = joins.empty() ? 1 : scale_of(worst->connection);
  out["shift_s"] = joins.empty() ? 0 : shift_of(worst->connection);
  out["cost"] = joins.empty() ? 0 : worst->connection.cost_cm;
  out["seam_speed_ratio"] = largest(&SeamRatios::speed);
  out["seam_acceleration_ratio"] = largest(&SeamRatios::acceleration);
  out["seam_root_acceleration_ratio"] = largest(&SeamRatios::root_acceleration);
  out["seams"] = Json::array();
  for (std::size_t i = 0; i < joins.size(); ++i) out["seams"].push_back(seam_json(plan, i));
  return out;
}

std::vector<StripBand> bands_of(const PlannedTransition& plan) {
  std::vector<StripBand> out;
  const Clip& clip = plan.transition.clip;
  for (std::size_t i = 0; i < plan.transition.joins.size(); ++i) {
    const double begin = plan.transition.begin[i], end = begin + plan.transition.joins[i].duration_s;
    const auto frame = [&](double time) {
      return std::clamp(static_cast<int>(time * clip.rate_hz), 0, clip.frames - 1);
    };
    out.push_back({.first_frame = frame(begin), .last_frame = frame(end), .label = "to " + plan.pieces[i + 1]});
  }
  return out;
}

void run_transition(const TransitionCommandOptions& options, Session& session) {
  static_cast<void>(files_written(options.output.file));  // an ending that cannot be written is told before the work
  LibraryView library(options.library);
  const auto plan = plan_transition(library, options.clips, options.plan, session.progress());
  session.finish_progress();
  Json result;
  if (plan) {
    result = to_json(*plan);
    write_synthesis(options.output, plan->transition.clip, bands_of(*plan), result, session);
  } else {
    result = {{"clips", Json::array()}, {"found", false}};
    session.note("no way leads from one clip to the next; nothing was written (--max-cost allows farther steps)");
  }
  options.output.json ? print_json(result) : print_fields(result);
}

}  // namespace

void add_transition(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("transition", "Play clips one after the other, without seams");
  const auto options = std::make_shared<TransitionCommandOptions>();
  command->add_option("LIB", options->library, "The library")->required();
  command->add_option("CLIP", options->clips, "Two clips or more, in the order they are played")->required();
  command->add_option("-o,--output", options->output.file, "The file to write: " + listed(clip_endings_written()))
      ->required();
  command->add_flag("--via-graph", options->plan.via_graph,
                    "Lead through other clips where motions are far apart; the first time makes the library's graph");
  command->add_option("--max-cost", options->plan.graph.largest_cost_cm, "The farthest step of the graph, in cm")
      ->capture_default_str();
  command
      ->add_option("--window", options->plan.graph.connection.window_s,
                   "Seconds of the end of one and the start of the next that may overlap")
      ->capture_default_str();
  command->add_option("--overlap", options->plan.graph.connection.shortest_s, "The smallest overlap in seconds")
      ->capture_default_str();
  command->add_flag("!--no-clean-feet", options->plan.join.plan_feet,
                    "Leave the feet as the blend has them; else they are planted over each overlap");
  command->add_flag("--clean-feet", options->output.clean_feet, "Take foot skate out of the clips as well");
  command->add_flag("--strict", options->output.strict, "With --clean-feet: feet that get worse are an error");
  command->add_option("--picture", options->output.picture, "Also write stick figures with the seams marked, .svg");
  command->add_flag("--json", options->output.json, "Print the figures as one JSON object");
  session.files.updates(command, {"LIB"});  // the graph is kept in it
  session.files.writes(command, {"--output"});
  session.files.writes(command, {"--picture"}, FileKind::svg);
  command->callback([options, &session] { run_transition(*options, session); });
}

}  // namespace kinespace::cli
