// Internal: what both OpenCL shapes of batched DTW share on the host.
#pragma once

#include <memory>
#include <string>

#include "kinespace/kernels/detail/dtw.h"
#include "kinespace/kernels/detail/opencl.h"

namespace kinespace::dtw_detail {

// The clips that some pair uses, their rows padded with zeros to a multiple of sixteen features.
struct PackedClips {
  std::vector<float> values;
  std::vector<int> first_row;  // by clip of the set
  int stride = 0;
};

struct DevicePair {
  int query = 0;
  int target = 0;
  std::size_t match = 0;  // where the result goes
};

// One call of dtw() on a device: the clips in its memory and the pairs that it can match.
class DeviceTask {
 public:
  // `transposed`: the roles of queries and targets are exchanged, and paths are turned back.
  DeviceTask(OpenClDevice& device, const FeatureSet& queries, const FeatureSet& targets, std::vector<DevicePair> pairs,
             const DtwOptions& options, bool transposed);

  [[nodiscard]] Region region(const DevicePair& pair) const {
    return region_of(queries.rows(pair.query), targets.rows(pair.target), options);
  }
  // Bounds of one batch.
  [[nodiscard]] std::uint64_t step_bytes() const;
  [[nodiscard]] std::uint64_t scratch_bytes() const;
  [[nodiscard]] cl::Kernel kernel(const char* source, const char* name) const;
  // The path of a match found, in the caller's roles.
  template <typename StepAt>
  [[nodiscard]] std::vector<FramePair> path(const DevicePair& pair, const StepAt& step_at) const {
    auto found = trace_back(queries.rows(pair.query), targets.rows(pair.target),
                            options.steps == StepPattern::slope_limited, step_at);
    if (transposed) {
      for (auto& cell : found) std::swap(cell.query, cell.target);
    }
    return found;
  }

  OpenClDevice& device;
  const FeatureSet& queries;
  const FeatureSet& targets;
  const DtwOptions& options;
  bool transposed;
  std::vector<DevicePair> pairs;
  PackedClips query_clips;
  PackedClips target_clips;  // empty when both sets are the same
  cl::CommandQueue queue;
  cl::Buffer query_values;
  cl::Buffer target_values;

  [[nodiscard]] const PackedClips& packed_targets() const { return &queries == &targets ? query_clips : target_clips; }
};

// Pairs that a shape cannot hold go to `left_over`, as match indices.
void match_in_lanes(DeviceTask& task, std::span<DtwMatch> matches, std::vector<std::size_t>& left_over);
void match_in_groups(DeviceTask& task, std::span<DtwMatch> matches, std::vector<std::size_t>& left_over);

}  // namespace kinespace::dtw_detail
