#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "cli/clip_input.h"
#include "cli/commands.h"
#include "cli/json_output.h"
#include "cli/option_checks.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/footskate/foot_planter.h"
#include "kinespace/library/library_view.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"

namespace kinespace::cli {
namespace {

struct ExportOptions {
  std::filesystem::path library;
  std::string clip;
  std::optional<std::filesystem::path> file;  // instead of a clip of the library
  ClipChoice choice;
  std::filesystem::path output;
  std::optional<int> functions;
  std::optional<double> max_error_cm;
  bool plant_feet = false;
  bool leave_feet = false;
  bool json = false;
};

// What is to be played.
struct Exported {
  EncodedClip clip;
  const RegisteredSpace& space;
  Skeleton skeleton;
  std::optional<Clip> read;    // the clip as it was read, where it is at hand
  std::optional<ClipRow> row;  // of the library
  int functions = 0;
  std::optional<LibraryView::LevelOfDetail> level;  // that --max-error asked for

  [[nodiscard]] Clip at(int n) const { return clip_from_curves(decode(space, clip, n), skeleton); }
};

Exported clip_of_library(const ExportOptions& options, LibraryView& library) {
  const ClipRow row = library.require_clip(options.clip);
  return {.clip = library.encoded(row),
          .space = library.space(row.space_id),
          .skeleton = library.skeleton(row.skeleton_id),
          .read = library.unchanged_source(row),
          .row = row};
}

Exported clip_of_file(const std::filesystem::path& file, const ClipChoice& choice, LibraryView& library,
                      Session& session) {
  Clip clip = read_input(file, choice, session);
  session.note_doubts(clip);
  const RegisteredSpace& space = library.require_space_for(clip, file);
  EncodedClip encoded = library.encode(clip, file);
  Skeleton skeleton = clip.skeleton;
  return {.clip = std::move(encoded), .space = space, .skeleton = std::move(skeleton), .read = std::move(clip)};
}

void choose_level(const ExportOptions& options, LibraryView& library, Session& session, Exported& out) {
  out.functions = out.space.levels();
  if (options.functions) out.functions = std::min(*options.functions, out.functions);
  if (!options.max_error_cm) return;
  out.level = out.row ? library.level_for_error(*out.row, *options.max_error_cm)
                      : library.level_for_error(out.clip, *out.read, *options.max_error_cm);
  out.functions = out.level->functions;
  if (!out.level->from_the_file) {
    session.note(
        "the file that the clip came from is not there unchanged: its error is that measured when the library "
        "was built, or never less");
  }
}

// Few functions let feet float, and then they are planted, unless an error was asked for: that is of the level as it is.
bool plants(const ExportOptions& options, const Exported& exported, Session& session) {
  const bool few = exported.functions < planted_below && !options.max_error_cm;
  if (options.leave_feet || !(options.plant_feet || few)) return false;
  if (exported.clip.feet) return true;
  if (exported.clip.rate_hz < least_contact_rate_hz) {
    session.note(fmt::format("{:.6g} frames a second are too few to tell when feet stand: no foot is planted",
                             exported.clip.rate_hz));
  } else if (exported.clip.frames > most_frames_with_feet) {
    session.note(fmt::format("feet are kept of clips of up to {} frames: no foot is planted", most_frames_with_feet));
  } else if (exported.row) {
    session.note(
        "the library knows of no foot of the clip that stands, and none is planted (libraries of before feet were kept "
        "know of none: build it again)");
  } else {
    session.note("no foot of the clip was found to stand: none is planted");
  }
  return false;
}

// Of the level that is played, or of the nearest coarser one that was measured.
void add_kept_error(const EncodedClip& clip, int level, Json& result) {
  const LevelError* known = nullptr;
  for (const LevelError& l : clip.levels) {
    if (l.level <= level) known = &l;
  }
  result["mean_joint_error_cm"] = known ? Json(known->error.mean_joint_error_cm) : Json();
  result["max_joint_error_cm"] = known ? Json(known->error.max_joint_error_cm) : Json();
  if (known && known->level != level) result["errors_of_level"] = known->level;
}

// How far what is written is from the clip as it was read; where that is not at hand, from all functions, and as much
// as these are from it on top: never less than it is.
void add_measured_error(const Exported& exported, const Clip& written, Json& result) {
  const MeasuredError& unseen = exported.clip.error;
  const MotionError seen = compare(exported.read ? *exported.read : exported.at(-1), written);
  const double mean = seen.mean_joint_error_cm + (exported.read ? 0 : unseen.mean_joint_error_cm);
  const double largest = seen.max_joint_error_cm + (exported.read ? 0 : unseen.max_joint_error_cm);
  result["mean_joint_error_cm"] = mean;
  result["max_joint_error_cm"] = largest;
}

void add_errors(const Exported& exported, const Clip& written, bool planted, Json& result) {
  if (exported.level) {
    result["max_joint_error_cm"] = exported.level->max_error_cm;
  } else if (exported.row && !planted) {
    add_kept_error(exported.clip, exported.functions, result);
  } else {
    add_measured_error(exported, written, result);
  }
}

void add_feet(const Exported& exported, const Clip& unplanted, const Clip& written, bool planted, Json& result) {
  result["feet_planted"] = planted;
  if (!exported.clip.feet) {
    for (const char* key :
         {"foot_slide_cm_s", "foot_slide_unplanted_cm_s", "foot_slide_original_cm_s", "floor_penetration_cm"}) {
      result[key] = Json();
    }
    return;
  }
  const KeptFeet& feet = *exported.clip.feet;
  const FeetMeasures now = measure_feet(written, feet, exported.clip.placement);
  const FeetMeasures before = planted ? measure_feet(unplanted, feet, exported.clip.placement) : now;
  result["foot_slide_cm_s"] = now.slide_cm_s;
  result["foot_slide_unplanted_cm_s"] = before.slide_cm_s;
  result["foot_slide_original_cm_s"] = feet.slide_cm_s;
  result["floor_penetration_cm"] = now.floor_penetration_cm;
}

// Of a difference over the frames.
struct Course {
  double sum = 0;
  double largest = 0;
  double last = 0;
  void add(double value) {
    sum += std::abs(value);
    largest = std::max(largest, std::abs(value));
    last = value;
  }
};

Eigen::Quaterniond root_of(const ClipCurves& curves, int frame) {
  const auto row = curves.values.row(frame);
  return Eigen::Quaterniond(row(3), row(4), row(5), row(6)).normalized();
}

void add_root(const ClipCurves& reference, const ClipCurves& played, Json& result) {
  constexpr double cm_per_metre = 100;
  constexpr double degrees = 180 / std::numbers::pi;
  Course height;
  Course heading;
  for (int f = 0; f < played.frames(); ++f) {
    height.add(cm_per_metre * (played.values(f, 1) - reference.values(f, 1)));
    heading.add(degrees * std::remainder(heading_of(root_of(played, f)) - heading_of(root_of(reference, f)),
                                         2 * std::numbers::pi));
  }
  result["mean_root_height_error_cm"] = height.sum / played.frames();
  result["max_root_height_error_cm"] = height.largest;
  result["root_height_drift_cm"] = height.last;
  result["mean_heading_error_deg"] = heading.sum / played.frames();
  result["max_heading_error_deg"] = heading.largest;
  result["heading_drift_deg"] = heading.last;
}

void require_one_clip(const ExportOptions& options) {
  if (options.clip.empty() != options.file.has_value()) {
    throw Error(ErrorKind::usage,
                {.found = options.file ? "both a clip of the library and --clip" : "no clip to export",
                 .expected = "the name of a clip of the library, or --clip and a file",
                 .remedy = "`kinespace info LIB --limit 0` lists the clips of a library"});
  }
}

void run_export(const ExportOptions& options, Session& session) {
  require_one_clip(options);
  static_cast<void>(files_written(options.output));  // an ending that cannot be written is told before the work
  LibraryView library(options.library);
  Exported exported =
      options.file ? clip_of_file(*options.file, options.choice, library, session) : clip_of_library(options, library);
  choose_level(options, library, session, exported);
  const bool planted = plants(options, exported, session);
  const ClipCurves played = decode(exported.space, exported.clip, exported.functions);
  const Clip unplanted = clip_from_curves(played, exported.skeleton);
  Clip written = unplanted;
  if (planted) plant_feet(written, *exported.clip.feet, exported.clip.placement);
  write_clip(options.output, written);
  Json result{{"clip", exported.clip.name},
              {"output", options.output.string()},
              {"frames", exported.clip.frames},
              {"functions", exported.functions},
              {"of_functions", exported.space.levels()}};
  add_errors(exported, written, planted, result);
  add_feet(exported, unplanted, written, planted, result);
  add_root(exported.read ? clip_curves(*exported.read) : decode(exported.space, exported.clip), played, result);
  result["root_errors_against"] = exported.read ? "the clip as it was read" : "all functions";
  options.json ? print_json(result) : print_fields(result);
}

}  // namespace

void add_export(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("export", "Play a clip of a library into a file, at any level of detail");
  const auto options = std::make_shared<ExportOptions>();
  command->add_option("LIB", options->library, "The library")->required();
  command->add_option("CLIP", options->clip, "The clip's name");
  command->add_option(
      "--clip", options->file,
      "A clip that is not in the library, played by the library's functions: " + listed(clip_endings_read()));
  add_clip_choice(command, options->choice);
  command->add_option("-o,--output", options->output, "The file to write: " + listed(clip_endings_written()))
      ->required();
  CLI::Option* lod =
      command->add_option("--lod", options->functions, "Use only the first N functions")->check(number_from_zero());
  CLI::Option* max_error =
      command
          ->add_option("--max-error", options->max_error_cm,
                       "The fewest functions with every joint this near to the clip as it was read, in cm")
          ->check(number_from_zero())
          ->excludes(lod);
  command
      ->add_flag("--plant-feet", options->plant_feet,
                 fmt::format("Feet stand where the original's stood (by itself below {} functions)", planted_below))
      ->excludes(max_error);
  command->add_flag("--no-plant-feet", options->leave_feet, "Feet are where the functions have them")
      ->excludes("--plant-feet");
  command->add_flag("--json", options->json, "Print what was written as one JSON object");
  session.files.reads(command, {"LIB", "--clip"});
  session.files.writes(command, {"--output"});
  command->callback([options, &session] { run_export(*options, session); });
}

}  // namespace kinespace::cli
