#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "cli/clip_input.h"
#include "cli/commands.h"
#include "cli/json_output.h"
#include "cli/level_table.h"
#include "cli/output.h"
#include "cli/repeat_report.h"
#include "cli/stream_file.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/base/printable.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/fpca/registration_picture.h"
#include "kinespace/library/library_view.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/plausibility.h"
#include "kinespace/motion/read.h"

namespace kinespace::cli {
namespace {

// What `info` can describe. The first row that claims a file describes it; a clip, last, claims every file, so that a
// file of no known kind gets the clip reader's message.
struct InfoOptions {
  std::filesystem::path file;
  std::optional<std::filesystem::path> basis;  // a library, for a stream that was made with one
  std::size_t limit = 100;                     // clips that are listed for people
  ClipChoice choice;                           // of a clip
  bool json = false;
  std::vector<std::filesystem::path> files;  // all that were named; several only to be compared with each other
  bool repeats = false;
  std::optional<std::filesystem::path> picture;
  std::string pictured_clip;  // of a library; empty: the one with the most whole cycles
};
struct Describer {
  bool (*claims)(const std::filesystem::path& file);
  Json (*describe)(const InfoOptions& options, Session& session);
};

void draw_clip(const Clip& clip, const std::filesystem::path& picture) {
  const ClipCurves curves = clip_curves(clip);
  const std::vector<Run> runs = SequenceCutter(clip, {}).cut(curves, clip.skeleton);
  write_file_atomically(picture, registration_picture_svg(curves, clip.skeleton, pictured(runs)));
}

int count_of(const std::vector<LostFrames>& gaps) {
  int out = 0;
  for (const LostFrames& gap : gaps) out += gap.last - gap.first + 1;
  return out;
}

Json describe_clip(const InfoOptions& options, Session& session) {
  std::vector<LostFrames> lost;
  const Clip clip = read_input(options.file, options.choice, session, &lost);
  session.note_doubts(clip);
  if (!options.pictured_clip.empty()) {
    throw Error(ErrorKind::usage, {.found = "--clip and a file that is a clip", .expected = "--clip with a library"});
  }
  if (options.picture) draw_clip(clip, *options.picture);
  const double height = clip.skeleton.rest_height();
  return {{"kind", "clip"},
          {"name", clip.name},
          {"frames", clip.frames},
          {"lost_frames", count_of(lost)},
          {"rate_hz", clip.rate_hz},
          {"duration_s", clip.duration_s()},
          {"joints", clip.skeleton.joint_count()},
          {"rotating_joints", clip.skeleton.rotating_joints().size()},
          {"height_cm", height},
          {"unit_guess", guess_unit(height)},
          {"bytes", std::filesystem::file_size(options.file)}};
}

bool is_library(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) return false;
  const std::string start = start_of_file(file);
  return Library::looks_like_library(std::as_bytes(std::span(start)));
}

Json describe_space(LibraryView& view, const SpaceRow& row) {
  const RegisteredSpace& space = view.space(row.id);
  Json sets = Json::array();
  for (const MotionSpace& set : space.sets()) {
    if (!space.has(set.options().cycles)) continue;
    sets.push_back({{"cycles", set.options().cycles},
                    {"points", set.points()},
                    {"functions", set.function_count()},
                    {"functions_of_a_curve", set.functions()},
                    {"variance", set.variance_covered()},
                    {"movement", set.movement_covered()}});
  }
  return {{"clips", 0},
          {"joints", space.skeleton().joint_count()},
          {"rotating_joints", space.layout().joint_count()},
          {"curves", space.curves()},
          {"points", space.plain().points()},
          {"functions", space.function_count()},
          {"levels", space.levels()},
          {"variance", space.variance_covered()},
          {"movement", space.movement_covered()},
          {"warped", space.warped()},
          {"sets", std::move(sets)}};
}

Json share_of(const std::optional<double>& part, double whole) {
  return part && whole > 0 ? Json(*part / whole) : Json();
}

double cycles_of(const Library& library) {
  return static_cast<double>(library.metadata_count("cycles").value_or(0));
}

int whole_cycles(const EncodedClip& clip) {
  int cycles = 0;
  for (const PicturedSequence& s : pictured(clip)) cycles += s.cycles;
  return cycles;
}

ClipRow most_cyclic(LibraryView& view) {
  std::optional<ClipRow> out;
  int most = -1;
  for (const ClipRow& row : view.library().clips()) {
    const int cycles = whole_cycles(view.encoded(row, 1));
    if (cycles > most) out = row;
    most = std::max(most, cycles);
  }
  if (!out) throw Error(ErrorKind::usage, {.found = "a library without clips", .expected = "one to draw"});
  return *out;
}

void draw_library_clip(LibraryView& view, const InfoOptions& options) {
  const ClipRow row = options.pictured_clip.empty() ? most_cyclic(view) : view.require_clip(options.pictured_clip);
  write_file_atomically(*options.picture, registration_picture_svg(view.curves(row), view.skeleton(row.skeleton_id),
                                                                   pictured(view.encoded(row, 1))));
}

// What a library keeps of the feet of its clips.
struct KeptFeetTotals {
  std::int64_t clips = 0;
  std::int64_t contacts = 0;
  std::int64_t bytes = 0;
  double frames = 0;
  double slide = 0;  // cm/s times frames

  void add(const ClipRow& clip, const std::optional<KeptFeet>& feet) {
    if (!feet) return;
    ++clips;
    contacts += static_cast<std::int64_t>(feet->contacts.size());
    bytes += static_cast<std::int64_t>(pack_feet(*feet).size());
    frames += static_cast<double>(clip.frames);
    slide += feet->slide_cm_s * static_cast<double>(clip.frames);
  }
  [[nodiscard]] Json mean_slide() const { return frames > 0 ? Json(slide / frames) : Json(); }
};

Json describe_library(const InfoOptions& options, Session& /*session*/) {
  LibraryView view(options.file);
  if (options.picture) draw_library_clip(view, options);
  const Library& library = view.library();
  const LibraryTotals totals = library.totals();
  Json clips = Json::array();
  Json spaces = Json::array();
  double rate = 0;
  std::int64_t joints = 0;
  double height = 0;
  std::map<std::int64_t, std::size_t> space_at;  // where it stands in the list, by id
  for (const SpaceRow& row : library.spaces()) {
    if (!row.name.starts_with("sequences ")) continue;
    space_at[row.id] = spaces.size();
    spaces.push_back(describe_space(view, row));
    joints = std::max<std::int64_t>(joints, view.space(row.id).skeleton().joint_count());
    height = std::max(height, view.space(row.id).skeleton().rest_height());
  }
  LevelTable levels;
  KeptFeetTotals feet;
  for (const ClipRow& row : library.clips()) {
    levels.add(row, view.level_errors(row));
    const std::optional<KeptFeet> of_clip = view.feet(row);
    feet.add(row, of_clip);
    rate = std::max(rate, row.rate_hz);
    const auto space = space_at.find(row.space_id);
    clips.push_back({{"name", row.name},
                     {"frames", row.frames},
                     {"rate_hz", row.rate_hz},
                     {"labels", row.labels},
                     {"foot_slide_cm_s", of_clip ? Json(of_clip->slide_cm_s) : Json()},
                     {"space", space == space_at.end() ? Json() : Json(space->second)}});
    if (space == space_at.end()) continue;
    Json& clips_of_space = spaces[space->second]["clips"];
    clips_of_space = clips_of_space.get<std::int64_t>() + 1;
  }
  return {{"kind", "library"},
          {"clips", totals.clips},
          {"sequences", or_null(library.metadata_count("sequences"))},
          {"functions", or_null(library.metadata_count("functions"))},
          {"variance", or_null(library.metadata_number("variance"))},
          {"movement", or_null(library.metadata_number("movement"))},
          {"cycles", or_null(library.metadata_count("cycles"))},
          {"cyclic_share", share_of(library.metadata_number("cyclic_seconds"), totals.seconds)},
          {"mean_cycle_s", share_of(library.metadata_number("cyclic_seconds"), cycles_of(library))},
          {"frames", totals.frames},
          {"seconds", totals.seconds},
          {"rate_hz", rate},
          {"joints", joints},
          {"height_cm", height},
          {"bytes", totals.file_bytes},
          {"vector_bytes", totals.vector_bytes},
          {"space_bytes", totals.space_bytes},
          {"retrieval_bytes", totals.retrieval_bytes},
          {"spaces", std::move(spaces)},
          {"levels", levels.rows()},
          {"clips_with_feet", feet.clips},
          {"foot_contacts", feet.contacts},
          {"feet_bytes", feet.bytes},
          {"foot_slide_cm_s", feet.mean_slide()},
          {"clip_list", std::move(clips)}};
}

bool is_stream(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) return false;
  const std::string start = start_of_file(file);
  return Bitstream::has_magic(std::as_bytes(std::span(start)));
}

Json describe_stream(const InfoOptions& options, Session& /*session*/) {
  if (options.picture) {
    throw Error(ErrorKind::usage,
                {.found = "--picture of a stream", .expected = "a clip or a library", .remedy = "decode it first"});
  }
  const StreamFile file(options.file, options.basis);
  const StreamReader* reader = &file.reader();
  const Bitstream& stream = reader->stream();
  const Skeleton& skeleton = reader->skeleton(0);
  std::int64_t frames = 0;
  double rate = 0;
  Json clips = Json::array();
  for (const ClipSummary& clip : reader->clips()) {
    frames += clip.frames;
    rate = std::max(rate, clip.rate_hz);
    clips.push_back({{"name", clip.name}, {"frames", clip.frames}, {"rate_hz", clip.rate_hz}});
  }
  return {{"kind", "stream"},
          {"codec", stream.kind().substr(stream.kind().find(':') + 1)},
          {"clips", reader->clips().size()},
          {"frames", frames},
          {"rate_hz", rate},
          {"joints", skeleton.joint_count()},
          {"rotating_joints", skeleton.rotating_joints().size()},
          {"height_cm", skeleton.rest_height()},
          {"levels", reader->levels()},
          {"complete", stream.complete()},
          {"bytes", file.bytes()},
          {"bytes_per_frame", static_cast<double>(file.bytes()) / static_cast<double>(frames)},
          {"mean_joint_error_cm", stream.error().mean_joint_error_cm},
          {"max_joint_error_cm", stream.error().max_joint_error_cm},
          {"shell_error_cm", stream.error().shell_error_cm},
          {"clip_list", std::move(clips)}};
}

// "walk happy": what a clip of a library is labelled.
std::string labels_of_row(const Json& clip) {
  std::string out;
  for (const Json& label : clip.value("labels", Json::array())) {
    out += (out.empty() ? "" : " ") + printable(label.get<std::string>());
  }
  return out;
}

// How near each level of detail comes to the clips as they were read.
void print_levels(const Json& levels) {
  if (levels.empty()) return;
  print("\n{:>9}  {:>7}  {:>10}  of\n", "functions", "mean cm", "largest cm");
  for (const Json& level : levels) {
    print("{:>9}  {:>7.3f}  {:>10.2f}  {}\n", level["functions"].get<int>(), level["mean_joint_error_cm"].get<double>(),
          level["max_joint_error_cm"].get<double>(), printable(level["worst_clip"].get<std::string>()));
  }
}

// The clips of a library or a stream for people, after its figures; and of a library its skeletons.
void print_lists(const Json& description, std::size_t limit) {
  if (description.contains("spaces")) {
    print("\n{:>8}  {:>6}  {:>8}  {:>9}\n", "skeleton", "joints", "rotating", "of clips");
    std::size_t number = 0;
    for (const Json& space : description["spaces"]) {
      print("{:>8}  {:>6}  {:>8}  {:>9}\n", ++number, space["joints"].get<int>(), space["rotating_joints"].get<int>(),
            space["clips"].get<std::int64_t>());
    }
  }
  if (description.contains("levels") && description["levels"].is_array()) print_levels(description["levels"]);
  if (!description.contains("clip_list")) return;
  const Json& clips = description["clip_list"];
  const std::size_t shown = limit == 0 ? clips.size() : std::min(limit, clips.size());
  print("\n{:>8}  {:>8}  {:>8}  clip\n", "frames", "rate Hz", "skeleton");
  for (std::size_t i = 0; i < shown; ++i) {
    const Json& clip = clips[i];
    const bool of_space = clip.contains("space") && clip["space"].is_number();
    const std::string labels = labels_of_row(clip);
    print("{:>8}  {:>8.6g}  {:>8}  {}{}\n", clip["frames"].get<std::int64_t>(), clip["rate_hz"].get<double>(),
          of_space ? clip["space"].get<std::int64_t>() + 1 : 1, printable(clip["name"].get<std::string>()),
          labels.empty() ? "" : "  (" + labels + ")");
  }
  if (shown < clips.size()) print("... and {} more; --limit 0 lists all\n", clips.size() - shown);
}

constexpr std::array describers{
    Describer{is_stream, describe_stream},
    Describer{is_library, describe_library},
    Describer{[](const std::filesystem::path&) { return true; }, describe_clip},
};

void run_info(InfoOptions& options, Session& session) {
  if (options.repeats) {
    report_repeats({.files = options.files, .picture = options.picture, .json = options.json}, session);
    return;
  }
  if (options.files.size() != 1) {
    throw Error(ErrorKind::usage, {.found = std::to_string(options.files.size()) + " files",
                                   .expected = "one",
                                   .remedy = "name several with --repeats only"});
  }
  if (options.picture && options.picture->extension() != ".svg") {
    throw Error(ErrorKind::usage, {.found = fmt::format("--picture \"{}\"", options.picture->string()),
                                   .expected = "a name that ends in .svg"});
  }
  options.file = options.files.front();
  for (const Describer& describer : describers) {
    if (!describer.claims(options.file)) continue;
    Json description = describer.describe(options, session);
    if (options.picture) description["picture"] = options.picture->string();
    if (options.json) return print_json(description);
    print_fields(description);
    return print_lists(description, options.limit);
  }
}

}  // namespace

void add_info(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("info", "What is in a file");
  const auto options = std::make_shared<InfoOptions>();
  command
      ->add_option(
          "FILE", options->files,
          fmt::format("A clip ({}), a library (.kspace) or a stream (.ksm); with --repeats clips and folders of them",
                      listed(clip_endings_read())))
      ->required();
  command->add_option("--basis", options->basis, "The library that a stream was encoded with, if it was with one");
  command->add_option("--limit", options->limit, "List at most so many clips; 0: all (--json always lists all)")
      ->capture_default_str();
  add_clip_choice(command, options->choice);
  command->add_flag("--json", options->json, "Print it as one JSON object");
  CLI::Option* repeats = command->add_flag(
      "--repeats", options->repeats, "Which stretches of the clips repeat others (repeated motion analysis, lin2011)");
  CLI::Option* picture = command->add_option(
      "--picture", options->picture,
      "An SVG of the cycles of a clip, and its curves before and after registration; with --repeats "
      "of the self-distance table");
  command
      ->add_option("--clip", options->pictured_clip, "The clip of a library to draw, not the one with the most cycles")
      ->needs(picture)
      ->excludes(repeats);
  session.files.reads(command, {"FILE", "--basis"});
  session.files.writes(command, {"--picture"}, FileKind::svg);
  command->callback([options, &session] { run_info(*options, session); });
}

}  // namespace kinespace::cli
