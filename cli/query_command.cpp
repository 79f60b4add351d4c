#include <filesystem>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "cli/clip_input.h"
#include "cli/commands.h"
#include "cli/device_choice.h"
#include "cli/json_output.h"
#include "cli/output.h"
#include "cli/stage_log.h"
#include "kinespace/base/error.h"
#include "kinespace/base/printable.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"
#include "kinespace/synthesis/retrieval.h"
#include "kinespace/synthesis/windows.h"

namespace kinespace::cli {
namespace {

struct QueryCommandOptions {
  std::filesystem::path library;
  std::string clip;
  ClipChoice choice;  // where the clip is a file
  QueryOptions query;
  bool no_rerank = false;
  bool windows = false;
  TimeRange range;
  bool overlapping = false;
  std::string device = "auto";
  bool json = false;
};

Json to_json(const std::string& query, const std::vector<Match>& matches) {
  Json list = Json::array();
  for (const Match& match : matches) {
    list.push_back({{"clip", match.clip},
                    {"distance", match.distance},
                    {"vector_distance", match.vector_distance},
                    {"start_s", match.start_s},
                    {"end_s", match.end_s},
                    {"labels", match.labels}});
  }
  return {{"query", query}, {"matches", std::move(list)}};
}

void print_matches(const std::vector<Match>& matches) {
  if (matches.empty()) {
    print("no match\n");
    return;
  }
  print("{:>10}  {:>8}  {:>8}  clip\n", "distance", "from s", "to s");
  for (const Match& match : matches)
    print("{:>10.5f}  {:>8.2f}  {:>8.2f}  {}\n", match.distance, match.start_s, match.end_s, printable(match.clip));
}

// A file that a clip can be read from; else a clip of the library; else whatever of that name is there, for the reader
// to say what is wrong with it.
bool is_file(const std::string& text, const Library& library) {
  if (!std::filesystem::exists(text)) return false;
  return is_motion_file(text) || !library.find_clip(text);
}

std::vector<Match> nearest(LibraryView& library, ClipCurves curves, const Skeleton& skeleton,
                           const QueryCommandOptions& options, const std::string& except, const Compute& compute,
                           const Progress& progress) {
  if (!options.windows)
    return nearest_motions(library, std::move(curves), skeleton, options.query, except, compute, progress);
  progress.at("windows", 0);
  return nearest_windows(library, curves, skeleton, options.range,
                         {.k = options.query.k, .overlapping = options.overlapping, .labels = options.query.labels},
                         {.weighted = options.query.weighted}, except);
}

std::vector<Match> find(LibraryView& library, const QueryCommandOptions& options, const Compute& compute,
                        const Progress& progress, Session& session) {
  if (is_file(options.clip, library.library())) {
    Clip clip = read_input(options.clip, options.choice, session);
    session.note_doubts(clip);
    progress.check_stop();
    if (!library.space_for(clip.skeleton)) {
      throw Error(ErrorKind::bad_input,
                  {.file = options.clip,
                   .found = "a skeleton that the library has no clips of",
                   .expected = "the joint names, parents and channels of its clips",
                   .remedy = "kinespace build --add --by-skeleton adds clips of another skeleton"});
    }
    const Skeleton skeleton = clip.skeleton;
    ClipCurves curves = clip_curves(std::move(clip));
    return nearest(library, std::move(curves), skeleton, options, {}, compute, progress);
  }
  const ClipRow row = library.require_clip(options.clip);
  return nearest(library, library.curves(row), library.skeleton(row.skeleton_id), options, row.name, compute, progress);
}

void run_query(QueryCommandOptions options, Session& session) {
  options.query.rerank = !options.no_rerank;
  options.query.validate();
  const Compute compute = open_device(options.device, session);
  StageLog stages(compute);
  stages.begin("read");
  LibraryView library(options.library);
  const std::vector<Match> matches = find(library, options, compute, stages.watch(session.stops()), session);
  Json result = to_json(options.clip, matches);
  if (!options.json) print_matches(matches);
  stages.finish(result, session);
  if (options.json) print_json(result);
}

}  // namespace

void add_query(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("query", "The motions of a library that are nearest to a clip");
  const auto options = std::make_shared<QueryCommandOptions>();
  command->add_option("LIB", options->library, "The library")->required();
  command
      ->add_option("CLIP", options->clip,
                   fmt::format("A clip of the library by its name, or a file ({})", listed(clip_endings_read())))
      ->required();
  add_clip_choice(command, options->choice);
  command->add_option("-k", options->query.k, "How many")->capture_default_str();
  command->add_flag("--no-rerank,!--rerank", options->no_rerank, "Order by the motion vectors alone, without DTW");
  command->add_option("--candidates", options->query.candidates, "How many the DTW orders again")
      ->capture_default_str();
  command->add_flag("--weighted", options->query.weighted, "Joint weights in the vector distance");
  command->add_option("--label", options->query.labels, "Only clips with this label; may be given again");
  auto* windows =
      command->add_flag("--windows", options->windows, "Look for a window of the clip inside the library's clips");
  command->add_option("--from", options->range.from_s, "Where the window starts, in seconds")
      ->capture_default_str()
      ->needs(windows);
  command->add_option("--to", options->range.to_s, "Where it ends; a second later unless given")->needs(windows);
  command->add_flag("--overlapping", options->overlapping, "Also windows that overlap a nearer one in the same clip")
      ->needs(windows);
  add_device_option(command, options->device);
  command->add_flag("--json", options->json, "Print the matches as one JSON object");
  session.files.reads(command, {"LIB", "CLIP"});
  command->callback([options, &session] { run_query(*options, session); });
}

}  // namespace kinespace::cli
