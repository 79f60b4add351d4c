#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "cli/clip_input.h"
#include "cli/commands.h"
#include "cli/foot_figures.h"
#include "cli/json_output.h"
#include "cli/output.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"
#include "kinespace/motion/strip.h"
#include "kinespace/synthesis/filling.h"

namespace kinespace::cli {
namespace {

struct FillCommandOptions {
  std::filesystem::path input;
  ClipChoice choice;
  std::filesystem::path output;
  std::filesystem::path library;
  std::optional<double> from_s;
  std::optional<double> to_s;
  std::optional<std::filesystem::path> picture;
  FillOptions fill;
  bool json = false;
};

// The frames whose times lie in [from, to].
FrameRange asked_gap(const Clip& clip, double from_s, double to_s) {
  const double end_s = clip.duration_s();
  if (!(from_s >= 0 && from_s <= to_s && to_s <= end_s)) {
    throw Error(ErrorKind::usage, {.found = fmt::format("--from {} --to {}", from_s, to_s),
                                   .expected = fmt::format("times in order, from 0 to {:.3f} s", end_s)});
  }
  // A time means the frame that is nearest to it.
  const FrameRange gap{static_cast<int>(std::lround(from_s * clip.rate_hz)),
                       static_cast<int>(std::lround(to_s * clip.rate_hz))};
  if (gap.count() < 1) {
    throw Error(ErrorKind::usage,
                {.found = fmt::format("no frame from {} s to {} s", from_s, to_s),
                 .expected = fmt::format("a stretch with a frame in it; frames are {:.4f} s apart", 1 / clip.rate_hz)});
  }
  return gap;
}

std::string times(const Clip& clip, const FrameRange& gap) {
  return fmt::format("{:.3f} to {:.3f} s", gap.first_frame / clip.rate_hz, gap.last_frame / clip.rate_hz);
}

// What looks missing in the clip with what its file says is lost, one after the other, none touching the next.
std::vector<FrameRange> candidates(const Clip& clip, const std::vector<LostFrames>& lost) {
  std::vector<FrameRange> all = missing_frames(clip);
  for (const LostFrames& gap : lost) all.push_back({gap.first, gap.last});
  std::ranges::sort(all, {}, &FrameRange::first_frame);
  std::vector<FrameRange> out;
  for (const FrameRange& gap : all) {
    if (!out.empty() && gap.first_frame <= out.back().last_frame + 1) {
      out.back().last_frame = std::max(out.back().last_frame, gap.last_frame);
    } else {
      out.push_back(gap);
    }
  }
  return out;
}

// What looks missing. A clip that is held at its start or end is common and no gap: there is nothing on its other side.
std::vector<FrameRange> found_gaps(const Clip& clip, const std::vector<LostFrames>& lost,
                                   const FillCommandOptions& options, Session& session) {
  std::vector<FrameRange> out;
  for (const FrameRange& gap : candidates(clip, lost)) {
    if (gap.first_frame < 2 || gap.last_frame > clip.frames - 3) {
      session.note(fmt::format("left as it is, seen from one side only: {}", times(clip, gap)));
    } else {
      session.note(fmt::format("missing: {} ({} frames)", times(clip, gap), gap.count()));
      out.push_back(gap);
    }
  }
  if (out.empty()) {
    throw Error(ErrorKind::bad_input,
                {.file = options.input.string(),
                 .found = "no missing frames",
                 .expected = "three or more frames that repeat the one before them or are zero, or nan",
                 .remedy = "say which frames are missing with --from and --to"});
  }
  return out;
}

// Without calibrating for gaps longer than those there are.
FillOptions options_for(const std::vector<FrameRange>& gaps, const Clip& clip, FillOptions options) {
  options.validate();
  double longest_s = 0.1;
  for (const FrameRange& gap : gaps) longest_s = std::max(longest_s, gap.count() / clip.rate_hz);
  options.max_gap_s = std::min(options.max_gap_s, longest_s);
  return options;
}

Json to_json(const FilledGap& gap, double rate_hz) {
  return {{"from_s", gap.frames.first_frame / rate_hz},
          {"to_s", gap.frames.last_frame / rate_hz},
          {"first_frame", gap.frames.first_frame},
          {"last_frame", gap.frames.last_frame},
          {"windows", gap.windows},
          {"mean_std_cm", gap.std_cm.mean()},
          {"max_std_cm", gap.std_cm.maxCoeff()}};
}

// The filled clip about its first gap, straight lines and slerp behind it.
void write_picture(const std::filesystem::path& path, const Clip& input, const FillResult& result) {
  Clip straight = input;
  StripOptions strip{.title = result.clip.name, .clip_label = "filled", .ghost_label = "slerp"};
  for (const FilledGap& gap : result.gaps) {
    straight = interpolate_gap(std::move(straight), gap.frames);
    strip.bands.push_back({gap.frames.first_frame, gap.frames.last_frame, "gap"});
  }
  const FrameRange& first = result.gaps.front().frames;
  const int around = static_cast<int>(std::lround(std::max(0.5, 0.5 * first.count() / input.rate_hz) * input.rate_hz));
  strip.first_frame = std::max(0, first.first_frame - around);
  strip.last_frame = std::min(input.frames - 1, first.last_frame + around);
  strip.ghost = &straight;
  write_strip(path, result.clip, strip);
}

void print_gaps(const FillResult& result, const FillModel& model) {
  print("{:>9}  {:>9}  {:>7}  {:>12}  {:>12}\n", "from s", "to s", "frames", "mean std cm", "max std cm");
  for (const FilledGap& gap : result.gaps) {
    print("{:>9.3f}  {:>9.3f}  {:>7}  {:>12.3f}  {:>12.3f}\n", gap.frames.first_frame / result.clip.rate_hz,
          gap.frames.last_frame / result.clip.rate_hz, gap.frames.count(), gap.std_cm.mean(), gap.std_cm.maxCoeff());
  }
  print("from {} clips, {:.0f} s\n", model.clips(), model.duration_s());
}

void run_fill(const FillCommandOptions& options, Session& session) {
  static_cast<void>(files_written(options.output));  // an ending that cannot be written is told before the work
  if (options.from_s.has_value() != options.to_s.has_value()) {
    throw Error(ErrorKind::usage, {.found = "one of --from and --to", .expected = "both or none"});
  }
  std::vector<LostFrames> lost;
  const Clip clip = read_input(options.input, options.choice, session, &lost);
  LibraryView library(options.library);
  const std::vector<FrameRange> gaps = options.from_s ? std::vector{asked_gap(clip, *options.from_s, *options.to_s)}
                                                      : found_gaps(clip, lost, options, session);
  require_fillable(clip, gaps);
  const FillModel model =
      FillModel::build(library, clip.skeleton, options_for(gaps, clip, options.fill), session.progress());
  session.finish_progress();
  const FillResult result = fill(model, clip, gaps);
  Session::check_stop();
  write_clip(options.output, result.clip);
  if (options.picture) write_picture(*options.picture, clip, result);
  if (!options.json) return print_gaps(result, model);
  Json list = Json::array();
  for (const FilledGap& gap : result.gaps) list.push_back(to_json(gap, clip.rate_hz));
  print_json({{"output", options.output.string()},
              {"frames", clip.frames},
              {"clips", model.clips()},
              {"found", !options.from_s.has_value()},
              {"gaps", std::move(list)},
              {"feet", foot_figures(result.clip)}});
}

}  // namespace

void add_fill(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("fill", "Estimate missing frames of a clip from a library of motions");
  const auto options = std::make_shared<FillCommandOptions>();
  command->add_option("IN", options->input, "The clip: " + listed(clip_endings_read()))->required();
  command->add_option("-o,--output", options->output, "The file to write: " + listed(clip_endings_written()))
      ->required();
  command->add_option("--library", options->library, "The library to learn from")->required();
  add_clip_choice(command, options->choice);
  command->add_option("--from", options->from_s,
                      "First missing time in seconds; else frames are looked for that "
                      "repeat the one before them or are zero, three or more");
  command->add_option("--to", options->to_s, "Last missing time in seconds");
  command->add_option("--max-gap", options->fill.max_gap_s, "Refuse gaps longer than this, in seconds")
      ->capture_default_str();
  command->add_option("--picture", options->picture, "Draw the first gap, slerp in grey behind it: .svg");
  command->add_flag("--json", options->json, "Print what was filled as one JSON object");
  session.files.reads(command, {"IN", "--library"});
  session.files.writes(command, {"--output"});
  session.files.writes(command, {"--picture"}, FileKind::svg);
  command->callback([options, &session] { run_fill(*options, session); });
}

}  // namespace kinespace::cli
