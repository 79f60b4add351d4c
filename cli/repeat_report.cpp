#include "cli/repeat_report.h"

#include <algorithm>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "cli/json_output.h"
#include "cli/output.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/base/printable.h"
#include "kinespace/codecs/rma/markers.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"
#include "kinespace/repeats/repeat_picture.h"
#include "kinespace/repeats/repeats.h"

namespace kinespace::cli {
namespace {

namespace fs = std::filesystem;

std::vector<Clip> read_all(const RepeatReportOptions& options, Session& session, const Progress& progress) {
  const std::vector<fs::path> files = find_motion_files(options.files);
  std::vector<Clip> out;
  for (std::size_t i = 0; i < files.size(); ++i) {
    progress.at("reading", static_cast<double>(i) / static_cast<double>(files.size()));
    Session::check_stop();
    const auto note = [&](const std::string& what) { session.note(what); };
    std::vector<Clip> clips = read_clips(files[i], {.note = note});
    std::ranges::move(clips, std::back_inserter(out));
    if (std::ranges::all_of(out, [&](const Clip& clip) { return clip.rate_hz == out.front().rate_hz; })) continue;
    throw Error(ErrorKind::bad_input,
                {.file = files[i].string(),
                 .found = fmt::format("{} frames per second", out.back().rate_hz),
                 .expected = fmt::format("{}, as in {}", out.front().rate_hz, files.front().string()),
                 .remedy = "give clips of one rate"});
  }
  return out;
}

// Where in which clip a stretch of the table lies.
class Places {
 public:
  Places(const std::vector<Clip>& clips, const FrameTable& table) : clips_(clips), table_(table) {}

  [[nodiscard]] Json place(const RepeatClip& stretch) const {
    const auto at = std::upper_bound(table_.starts.begin(), table_.starts.end(), stretch.first) - 1;
    const auto seconds = [&](std::int64_t frame) { return static_cast<double>(frame - *at) / table_.rate_hz; };
    return {{"clip", clips_[static_cast<std::size_t>(at - table_.starts.begin())].name},
            {"start_s", seconds(stretch.first)},
            {"end_s", seconds(stretch.last)}};
  }

 private:
  const std::vector<Clip>& clips_;
  const FrameTable& table_;
};

Json primaries(const RepeatAnalysis& analysis, const Places& places) {
  std::vector<Json> by_clip(analysis.clips.size());
  for (std::size_t c = 0; c < analysis.clips.size(); ++c) {
    const RepeatClip& clip = analysis.clips[c];
    if (clip.kind != RepeatClip::Kind::primary) continue;
    by_clip[c] = places.place(clip);
    by_clip[c]["group"] = clip.group;
    by_clip[c]["repetitions"] = Json::array();
  }
  for (const RepeatClip& clip : analysis.clips) {
    if (clip.kind != RepeatClip::Kind::repeated) continue;
    by_clip[static_cast<std::size_t>(clip.primary)]["repetitions"].push_back(places.place(clip));
  }
  Json out = Json::array();
  for (Json& clip : by_clip) {
    if (!clip.is_null()) out.push_back(std::move(clip));
  }
  return out;
}

std::string line_of(const Json& place) {
  return fmt::format("{}  {:.2f} s to {:.2f} s", printable(place["clip"].get<std::string>()),
                     place["start_s"].get<double>(), place["end_s"].get<double>());
}

void print_primaries(const Json& report) {
  for (const Json& primary : report["primaries"]) {
    print("\n{}\n", line_of(primary));
    for (const Json& repetition : primary["repetitions"]) print("  again  {}\n", line_of(repetition));
  }
}

}  // namespace

void report_repeats(const RepeatReportOptions& options, Session& session) {
  const Progress progress = session.progress();
  const std::vector<Clip> clips = read_all(options, session, progress);
  progress.at("analysing", 0);
  const FrameTable table = marker_table(clips);
  const RepeatAnalysis analysis = analyse_repeats(table, {}, progress);
  Session::check_stop();
  Json report{{"kind", "repeats"},
              {"clips", clips.size()},
              {"frames", table.frames},
              {"rate_hz", table.rate_hz},
              {"groups", analysis.grouping.groups},
              {"share_primary", analysis.share(RepeatClip::Kind::primary)},
              {"share_repeated", analysis.share(RepeatClip::Kind::repeated)},
              {"share_unique", analysis.share(RepeatClip::Kind::unique)},
              {"primaries", primaries(analysis, Places(clips, table))}};
  if (options.picture) {
    write_file_atomically(*options.picture, repeat_picture_svg(table, analysis));
    report["picture"] = options.picture->string();
  }
  session.finish_progress();
  if (options.json) {
    print_json(report);
  } else {
    print_fields(report);
    print_primaries(report);
  }
}

}  // namespace kinespace::cli
