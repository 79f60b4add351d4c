#include "codecs/rma/repeats.h"

#include <algorithm>
#include <cmath>

#include "codecs/rma/option_range.h"
#include "codecs/rma/repeat_clips.h"
#include "codecs/rma/table_parts.h"

namespace kinespace {

void RepeatOptions::validate() const {
  segmentation.validate();
  grouping.validate();
  require_option("variance", variance, 0.5, 1);
  require_option("table_rate_hz", table_rate_hz, 1, 1000);
  require_option("table_frames", table_frames, 100, 200'000);
  paths.validate();
  choice.validate();
}

std::string_view to_string(RepeatClip::Kind kind) {
  switch (kind) {
    case RepeatClip::Kind::primary:
      return "primary";
    case RepeatClip::Kind::repeated:
      return "repeated";
    case RepeatClip::Kind::unique:
      break;
  }
  return "unique";
}

double RepeatAnalysis::share(RepeatClip::Kind kind) const {
  std::int64_t all = 0, of_kind = 0;
  for (const RepeatClip& clip : clips) {
    all += clip.frames();
    if (clip.kind == kind) of_kind += clip.frames();
  }
  return all > 0 ? static_cast<double>(of_kind) / static_cast<double>(all) : 0;
}

RepeatAnalysis analyse_repeats(const FrameTable& table, const RepeatOptions& options) {
  options.validate();
  table.validate();
  RepeatAnalysis out;
  out.grouping = group_segments(table, behaviour_segments(table, options.segmentation), options.grouping);
  ClipCollector collector(table, options.choice.shortest_s);
  for (int group = 0; group < out.grouping.groups; ++group) {
    const std::vector<FrameRange> ranges = out.grouping.ranges(group, table);
    out.spaces.push_back(fit_group_space(table, ranges, {.variance = options.variance}));
    for (const TablePart& part : table_parts(ranges, table.rate_hz, options)) {
      if (!options.find_repeats) {
        collector.add_unique(group, part.ranges);
        continue;
      }
      const SelfDistance distances(out.spaces.back(), table, part.ranges, part.stride);
      const std::vector<PosturePath> paths = find_posture_paths(distances, options.paths);
      collector.add(group, distances, choose_repeats(distances, paths, options.choice));
    }
  }
  out.clips = std::move(collector).finish();
  return out;
}

}  // namespace kinespace
