// The host side of dtw_lanes.cl: pairs with the same query, sixteen targets of similar lengths at a time.
#include <array>

#include "kinespace/base/parallel.h"
#include "kinespace/kernels/detail/dtw_opencl.h"

namespace kinespace::dtw_detail {
namespace {

constexpr int kLanes = 16;
constexpr int kRows = 4;
constexpr int kFrames = 4;
constexpr std::size_t kVectorBytes = 64;

// As dtw_lanes.cl has them.
struct Job {
  cl_ulong scratch = 0;
  cl_ulong steps = 0;
  cl_int query_row = 0;
  cl_int rows = 0;
  cl_int tiles = 0;
  cl_int ranges = 0;
};
struct TileRange {
  cl_int first = 0;
  cl_int end = 0;
  cl_int steps = 0;
};
struct Lanes {
  std::array<cl_int, kLanes> first_row;
  std::array<cl_int, kLanes> rows;
  std::array<cl_int, kLanes> band;
};

// Up to sixteen pairs of one query.
struct LaneGroup {
  std::span<const DevicePair> pairs;
  std::vector<TileRange> ranges;
  std::uint64_t step_vectors = 0;
  std::uint64_t scratch_vectors = 0;
};

int tiles_of(int frames) {
  return (frames + kFrames - 1) / kFrames;
}

// The rows that have legal cells in each tile of some lane. The bounds never fall from tile to tile: the kernel's
// column must hold no row of an older column.
std::vector<TileRange> tile_ranges(const DeviceTask& task, std::span<const DevicePair> pairs) {
  int longest = 0;
  for (const auto& pair : pairs) longest = std::max(longest, task.targets.rows(pair.target));
  std::vector<TileRange> ranges(static_cast<std::size_t>(tiles_of(longest)));
  const int n = task.queries.rows(pairs.front().query);
  for (auto& range : ranges) range = {.first = n, .end = 0, .steps = 0};
  for (const auto& pair : pairs) {
    const Region region = task.region(pair);
    const int m = static_cast<int>(region.m);
    for (int tile = 0; tile < tiles_of(m); ++tile) {
      auto& range = ranges[tile];
      const int last = std::min(tile * kFrames + kFrames, m) - 1;
      range.first = std::min(range.first, static_cast<int>(region.first_row(std::int64_t{kFrames} * tile)));
      range.end = std::max(range.end, static_cast<int>(region.end_row(last)));
    }
  }
  for (std::size_t tile = ranges.size() - 1; tile-- > 0;) {
    ranges[tile].first = std::min(ranges[tile].first, ranges[tile + 1].first);
  }
  int end = 0;
  for (auto& range : ranges) {
    end = std::max(end, range.end);
    range.first = range.first / kRows * kRows;
    range.end = std::max(end, range.first);
  }
  return ranges;
}

// Sets where each tile's back-pointers go and returns how many vectors there are.
std::uint64_t place_steps(std::vector<TileRange>& ranges) {
  std::uint64_t vectors = 0;
  for (auto& range : ranges) {
    range.steps = static_cast<cl_int>(vectors);
    vectors += static_cast<std::uint64_t>((range.end - range.first + kRows - 1) / kRows);
  }
  return vectors;
}

std::vector<LaneGroup> gather(DeviceTask& task) {
  std::sort(task.pairs.begin(), task.pairs.end(), [&](const DevicePair& a, const DevicePair& b) {
    if (a.query != b.query) return a.query < b.query;
    const int rows_a = task.targets.rows(a.target);
    const int rows_b = task.targets.rows(b.target);
    return rows_a != rows_b ? rows_a < rows_b : a.match < b.match;
  });
  std::vector<LaneGroup> groups;
  const std::span<const DevicePair> pairs(task.pairs);
  for (std::size_t at = 0; at < pairs.size();) {
    std::size_t count = 1;
    while (count < kLanes && at + count < pairs.size() && pairs[at + count].query == pairs[at].query) ++count;
    groups.push_back({.pairs = pairs.subspan(at, count)});
    at += count;
  }
  return groups;
}

void measure(const DeviceTask& task, LaneGroup& group) {
  group.ranges = tile_ranges(task, group.pairs);
  group.step_vectors = place_steps(group.ranges);
  const auto rows = static_cast<std::uint64_t>(task.queries.rows(group.pairs.front().query));
  group.scratch_vectors = 2 * (rows + kRows) + static_cast<std::uint64_t>(kFrames) * task.query_clips.stride;
}

Lanes lanes_of(const DeviceTask& task, const LaneGroup& group) {
  Lanes lanes{};
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const auto& pair = group.pairs[std::min(lane, group.pairs.size() - 1)];  // lanes to spare repeat the last pair
    lanes.first_row[lane] = task.packed_targets().first_row[pair.target];
    lanes.rows[lane] = task.targets.rows(pair.target);
    lanes.band[lane] = static_cast<cl_int>(task.region(pair).band);
  }
  return lanes;
}

class LaneRunner {
 public:
  LaneRunner(DeviceTask& task, std::span<DtwMatch> matches)
      : task_(task), matches_(matches), kernel_(task.kernel(opencl_source::dtw_lanes, "dtw_lanes")) {}

  void run(std::span<const LaneGroup> batch) {
    place(batch);
    ensure(scratch_, scratch_bytes_, scratch_vectors_ * kVectorBytes);
    ensure(steps_, steps_bytes_, (task_.options.want_path ? step_vectors_ : 1) * kVectorBytes);
    std::vector<float> costs(batch.size() * kLanes);
    const auto cost_buffer = task_.device.scratch(costs.size() * sizeof(float));
    const auto job_buffer = task_.device.input(std::span<const Job>(jobs_));
    const auto range_buffer = task_.device.input(std::span<const TileRange>(ranges_));
    const auto lane_buffer = task_.device.input(std::span<const Lanes>(lanes_));
    set_arguments(kernel_, task_.query_values, task_.target_values, cl_int{task_.queries.dims},
                  cl_int{task_.query_clips.stride}, job_buffer, range_buffer, lane_buffer,
                  cl_int{task_.options.band_fraction > 0}, cl_int{task_.options.squared}, cl_int{task_.transposed},
                  scratch_, steps_, cost_buffer);
    task_.device.launch(KernelFamily::dtw, task_.queue, kernel_, cl::NDRange(batch.size()), cl::NDRange(1));
    task_.queue.enqueueReadBuffer(cost_buffer, CL_TRUE, 0, costs.size() * sizeof(float), costs.data());
    for (std::size_t g = 0; g < batch.size(); ++g) {
      for (std::size_t lane = 0; lane < batch[g].pairs.size(); ++lane) {
        matches_[batch[g].pairs[lane].match].cost = costs[g * kLanes + lane];
      }
    }
    if (task_.options.want_path) trace(batch);
  }

 private:
  void place(std::span<const LaneGroup> batch) {
    jobs_.clear();
    ranges_.clear();
    lanes_.clear();
    scratch_vectors_ = 0;
    step_vectors_ = 0;
    for (const auto& group : batch) {
      const int query = group.pairs.front().query;
      jobs_.push_back({.scratch = scratch_vectors_,
                       .steps = step_vectors_,
                       .query_row = task_.query_clips.first_row[query],
                       .rows = task_.queries.rows(query),
                       .tiles = static_cast<cl_int>(group.ranges.size()),
                       .ranges = static_cast<cl_int>(ranges_.size())});
      ranges_.insert(ranges_.end(), group.ranges.begin(), group.ranges.end());
      lanes_.push_back(lanes_of(task_, group));
      scratch_vectors_ += group.scratch_vectors;
      step_vectors_ += group.step_vectors;
    }
  }

  // Buffers are kept between batches: fresh pages are dear.
  void ensure(cl::Buffer& buffer, std::size_t& held, std::size_t wanted) const {
    if (wanted <= held) return;
    buffer = task_.device.scratch(wanted);
    held = wanted;
  }

  void trace(std::span<const LaneGroup> batch) {
    const auto bytes = step_vectors_ * kVectorBytes;
    const auto* steps =
        static_cast<const std::uint32_t*>(task_.queue.enqueueMapBuffer(steps_, CL_TRUE, CL_MAP_READ, 0, bytes));
    parallel_for(std::size_t{0}, batch.size(), [&](std::size_t g) {
      const std::uint32_t* own = steps + jobs_[g].steps * kLanes;
      for (std::size_t lane = 0; lane < batch[g].pairs.size(); ++lane) trace_lane(batch[g], own + lane, lane);
    });
    task_.queue.enqueueUnmapMemObject(steps_, const_cast<std::uint32_t*>(steps));
    task_.queue.finish();
  }

  void trace_lane(const LaneGroup& group, const std::uint32_t* steps, std::size_t lane) {
    auto& match = matches_[group.pairs[lane].match];
    if (!match.found()) return;
    match.path = task_.path(group.pairs[lane], [&](int i, int j) {
      const auto& range = group.ranges[j / kFrames];
      const std::int64_t vector = range.steps + (i - range.first) / kRows;
      return (steps[vector * kLanes] >> (2 * (i % kRows * kFrames + j % kFrames))) & 3U;
    });
  }

  DeviceTask& task_;
  std::span<DtwMatch> matches_;
  cl::Kernel kernel_;
  std::vector<Job> jobs_;
  std::vector<TileRange> ranges_;
  std::vector<Lanes> lanes_;
  std::uint64_t scratch_vectors_ = 0;
  std::uint64_t step_vectors_ = 0;
  cl::Buffer scratch_;
  cl::Buffer steps_;
  std::size_t scratch_bytes_ = 0;
  std::size_t steps_bytes_ = 0;
};

}  // namespace

void match_in_lanes(DeviceTask& task, std::span<DtwMatch> matches, std::vector<std::size_t>& left_over) {
  auto groups = gather(task);
  parallel_for(std::size_t{0}, groups.size(), [&](std::size_t g) { measure(task, groups[g]); });
  const auto most_steps =
      task.options.want_path ? task.step_bytes() / kVectorBytes : std::numeric_limits<std::uint64_t>::max();
  const auto most_scratch = task.scratch_bytes() / kVectorBytes;
  std::erase_if(groups, [&](const LaneGroup& group) {
    const bool fits = group.step_vectors <= most_steps && group.scratch_vectors <= most_scratch;
    for (const auto& pair : group.pairs) {
      if (!fits) left_over.push_back(pair.match);
    }
    return !fits;
  });
  // The longest first, so that no core is left with a long one at the end.
  std::stable_sort(groups.begin(), groups.end(),
                   [](const LaneGroup& a, const LaneGroup& b) { return a.step_vectors > b.step_vectors; });
  LaneRunner runner(task, matches);
  const std::span<const LaneGroup> all(groups);
  for (std::size_t at = 0; at < all.size();) {
    std::uint64_t steps = 0;
    std::uint64_t scratch = 0;
    std::size_t count = 0;
    while (at + count < all.size() && (count == 0 || (steps + all[at + count].step_vectors <= most_steps &&
                                                      scratch + all[at + count].scratch_vectors <= most_scratch))) {
      steps += all[at + count].step_vectors;
      scratch += all[at + count].scratch_vectors;
      ++count;
    }
    runner.run(all.subspan(at, count));
    at += count;
  }
}

}  // namespace kinespace::dtw_detail
