#include "kinespace/kernels/detail/dtw_opencl.h"

#include <algorithm>

namespace kinespace::dtw_detail {
namespace {

constexpr std::int64_t kLargestTable = std::int64_t{1} << 30;  // cells: the kernels compute positions in 32 bits
constexpr int kLanes = 16;

PackedClips pack(const FeatureSet& set, const std::vector<bool>& used) {
  PackedClips packed;
  packed.stride = (set.dims + kLanes - 1) / kLanes * kLanes;
  packed.first_row.assign(used.size(), 0);
  std::size_t rows = 0;
  for (int clip = 0; clip < set.clips(); ++clip) {
    packed.first_row[clip] = static_cast<int>(rows);
    if (used[clip]) rows += static_cast<std::size_t>(set.rows(clip));
  }
  packed.values.assign(rows * static_cast<std::size_t>(packed.stride), 0.0F);
  for (int clip = 0; clip < set.clips(); ++clip) {
    if (!used[clip]) continue;
    const auto from = set.clip(clip);
    float* to = packed.values.data() + static_cast<std::ptrdiff_t>(packed.first_row[clip]) * packed.stride;
    for (int row = 0; row < set.rows(clip); ++row, to += packed.stride) {
      std::copy_n(from.data() + static_cast<std::ptrdiff_t>(row) * set.dims, set.dims, to);
    }
  }
  return packed;
}

// The pairs that have a legal path and fit the kernels.
std::vector<DevicePair> pairs_for_device(const FeatureSet& queries, const FeatureSet& targets,
                                         std::span<const ClipPair> pairs, const DtwOptions& options,
                                         std::vector<std::size_t>& left_over) {
  std::vector<DevicePair> kept;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const auto region = region_of(queries.rows(pairs[p].query), targets.rows(pairs[p].target), options);
    if (!region.has_path()) continue;
    if ((region.n + 4) * (region.m + 4) < kLargestTable) {
      kept.push_back({pairs[p].query, pairs[p].target, p});
    } else {
      left_over.push_back(p);
    }
  }
  return kept;
}

}  // namespace

DeviceTask::DeviceTask(OpenClDevice& a_device, const FeatureSet& a_queries, const FeatureSet& a_targets,
                       std::vector<DevicePair> a_pairs, const DtwOptions& a_options, bool is_transposed)
    : device(a_device),
      queries(a_queries),
      targets(a_targets),
      options(a_options),
      transposed(is_transposed),
      pairs(std::move(a_pairs)),
      queue(device.queue()) {
  std::vector<bool> used_queries(queries.clips(), false);
  std::vector<bool> used_targets(targets.clips(), false);
  const bool same = &queries == &targets;
  for (const auto& pair : pairs) {
    used_queries[pair.query] = true;
    (same ? used_queries : used_targets)[pair.target] = true;
  }
  query_clips = pack(queries, used_queries);
  query_values = device.input(std::span<const float>(query_clips.values));
  if (same) {
    target_values = query_values;
  } else {
    target_clips = pack(targets, used_targets);
    target_values = device.input(std::span<const float>(target_clips.values));
  }
}

std::uint64_t DeviceTask::step_bytes() const {
  return std::min<std::uint64_t>(options.path_memory_bytes, device.largest_buffer());
}

std::uint64_t DeviceTask::scratch_bytes() const {
  return std::min<std::uint64_t>(std::uint64_t{128} << 20, device.largest_buffer());
}

cl::Kernel DeviceTask::kernel(const char* source, const char* name) const {
  const bool slopes = options.steps == StepPattern::slope_limited;
  return device.kernel(
      source,
      std::string("-DSLOPE_LIMITED=") + (slopes ? "1" : "0") + " -DWANT_PATH=" + (options.want_path ? "1" : "0"), name);
}

void dtw_opencl(OpenClDevice& device, bool lanes, const FeatureSet& queries, const FeatureSet& targets,
                std::span<const ClipPair> pairs, const DtwOptions& options, std::span<DtwMatch> matches,
                std::vector<std::size_t>& left_over) {
  auto kept = pairs_for_device(queries, targets, pairs, options, left_over);
  if (kept.empty()) return;
  const bool transposed = lanes && group_pairs(queries, targets, pairs).by_target;
  if (transposed) {
    for (auto& pair : kept) std::swap(pair.query, pair.target);
  }
  opencl_call("dtw", [&] {
    DeviceTask task(device, transposed ? targets : queries, transposed ? queries : targets, std::move(kept), options,
                    transposed);
    if (lanes) {
      match_in_lanes(task, matches, left_over);
    } else {
      match_in_groups(task, matches, left_over);
    }
  });
}

}  // namespace kinespace::dtw_detail
