// The search for the quantiser step that meets a target, or for tables that are worth sharing. Private to this folder.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kinespace/codecs/pose_space/detail/pose_space_encoder.h"

namespace kinespace {

class PoseSpaceSearch {
 public:
  // `basis`: what the stream shares, or nullptr. Throws Error as Codec::encode does.
  PoseSpaceSearch(std::span<const Clip> clips, const Progress& progress, PoseSpaceSettings settings, double shell_ratio,
                  const PoseSpaceBasis* basis);

  // The stream at this step, or the smallest found that keeps to the target. Throw Error{usage} when none does.
  [[nodiscard]] Bytes at_step(double step);
  [[nodiscard]] Bytes for_mean_error(double target_cm);
  [[nodiscard]] Bytes for_max_error(double target_cm);
  [[nodiscard]] Bytes for_bytes(std::int64_t target);

  // Tables for clips like these at this step.
  [[nodiscard]] PoseSpaceTables tables_at(double step, bool all_components);
  [[nodiscard]] const std::vector<Skeleton>& skeletons() const { return encoder_.skeletons(); }

 private:
  void settle(double step);
  void sample_at(double step);
  double approach(double step, double target);
  double balance(double step, std::optional<double> target);
  Bytes refine(double step, double target);

  PoseSpaceEncoder encoder_;
  PoseSpaceSettings settings_;
  double shell_ratio_;
  const PoseSpaceBasis* basis_;
  int sample_ = 1;
  std::optional<Attempt> last_;
};

}  // namespace kinespace
