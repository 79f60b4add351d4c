#include "kinespace/repeats/repeats.h"

#include <algorithm>
#include <mutex>
#include <numeric>

#include "kinespace/base/parallel.h"
#include "kinespace/repeats/detail/option_range.h"
#include "kinespace/repeats/detail/repeat_clips.h"
#include "kinespace/repeats/detail/table_parts.h"

namespace kinespace {

void RepeatOptions::validate() const {
  segmentation.validate();
  grouping.validate();
  require_option("variance", variance, 0.5, 1);
  require_option("table_rate_hz", table_rate_hz, 1, 1000);
  require_option("table_frames", table_frames, 100, 200'000);
  require_option("clip_frames", clip_frames, 1000, 1e7);
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

namespace {

// Tables that are in memory at a time.
constexpr int tables_at_once = 4;

// One self-distance table to go through, and what was chosen in it.
struct Work {
  int group = 0;
  TablePart part;
  std::vector<RepeatClip> clips;
};

std::vector<Work> work_of(const RepeatAnalysis& analysis, const FrameTable& table, const RepeatOptions& options) {
  std::vector<Work> out;
  for (int group = 0; group < analysis.grouping.groups; ++group) {
    for (TablePart& part : table_parts(analysis.grouping.ranges(group, table), table, options)) {
      out.push_back({group, std::move(part), {}});
    }
  }
  return out;
}

// The clips of all tables in time, with references to the clips of the whole.
std::vector<RepeatClip> merged(std::vector<Work>& work) {
  std::vector<RepeatClip> out;
  for (Work& item : work) {
    const int before = static_cast<int>(out.size());
    for (RepeatClip& clip : item.clips) {
      if (clip.primary >= 0) clip.primary += before;
      out.push_back(std::move(clip));
    }
  }
  std::vector<int> order(out.size()), place(out.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return out[static_cast<std::size_t>(a)].first < out[static_cast<std::size_t>(b)].first;
  });
  std::vector<RepeatClip> sorted;
  for (std::size_t k = 0; k < order.size(); ++k) {
    place[static_cast<std::size_t>(order[k])] = static_cast<int>(k);
    sorted.push_back(std::move(out[static_cast<std::size_t>(order[k])]));
  }
  for (RepeatClip& clip : sorted) {
    if (clip.primary >= 0) clip.primary = place[static_cast<std::size_t>(clip.primary)];
  }
  return sorted;
}

}  // namespace

RepeatAnalysis analyse_repeats(const FrameTable& table, const RepeatOptions& options, const Progress& progress) {
  options.validate();
  table.validate();
  RepeatAnalysis out;
  out.grouping = group_segments(table, behaviour_segments(table, options.segmentation), options.grouping);
  progress.check_stop();
  out.spaces.resize(static_cast<std::size_t>(out.grouping.groups));
  parallel_for(std::size_t{0}, out.spaces.size(), [&](std::size_t group) {
    const std::vector<FrameSpan> ranges = out.grouping.ranges(static_cast<int>(group), table);
    out.spaces[group] = fit_group_space(table, ranges, {.variance = options.variance});
  });

  std::vector<Work> work = work_of(out, table, options);
  const auto choose = [&](Work* item) {
    ClipCollector collector(table, options.choice.shortest_s);
    if (options.find_repeats) {
      const GroupSpace& space = out.spaces[static_cast<std::size_t>(item->group)];
      const SelfDistance distances(space, table, item->part.ranges, item->part.stride);
      const std::vector<PosturePath> paths = find_posture_paths(distances, options.paths);
      collector.add({item->group, space, distances}, choose_repeats(distances, paths, options.choice));
    } else {
      collector.add_unique(item->group, item->part.ranges);
    }
    item->clips = std::move(collector).finish();
  };
  std::mutex drawing;
  std::size_t next = 0;
  const auto draw = [&]() -> Work* {
    const std::lock_guard one(drawing);
    progress.check_stop();
    return next < work.size() ? &work[next++] : nullptr;
  };
  parallel_for(0, tables_at_once, [&](int) {
    while (Work* item = draw()) choose(item);
  });
  out.clips = merged(work);
  return out;
}

}  // namespace kinespace
