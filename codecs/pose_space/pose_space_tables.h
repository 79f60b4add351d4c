// What all clips of a motion-space stream share, and the way from decoded coefficients to pose vectors.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kinespace/codecs/pose_space/joint_basis.h"
#include "kinespace/codecs/stream/clip_table.h"
#include "kinespace/codecs/stream/natural_functions.h"
#include "kinespace/codecs/stream/pose_vectors.h"
#include "kinespace/entropy/coefficient_coder.h"

namespace kinespace {

struct PoseSpaceTables {
  double step = 1;          // of the quantiser: cm times the square root of the number of joints
  double shell_weight = 0;  // of the metric that L0 comes from (position_metric.h)
  int group_frames = 4096;  // windows are coded in groups of at least so many frames, each decodable alone
  ReferencePose reference;
  JointBasis basis;
  CoefficientTables coding;
};

[[nodiscard]] Bytes pack_pose_space_tables(const PoseSpaceTables& tables);
// Throws Error{bad_input} naming `source`.
[[nodiscard]] PoseSpaceTables unpack_pose_space_tables(std::span<const std::byte> bytes, int rotating_joints,
                                                       const std::string& source);

// What a stream with a shared basis says for itself: step, groups, spectrum, and the rung that the rest is taken from.
[[nodiscard]] Bytes pack_own_tables(const PoseSpaceTables& tables, int rung);
[[nodiscard]] PoseSpaceTables unpack_own_tables(std::span<const std::byte> bytes,
                                                std::span<const PoseSpaceTables> rungs, const std::string& source);

// One window of one clip in the stream.
struct WindowPlace {
  int clip = 0;
  int first = 0;  // frame of the clip
  int points = 0;
  int finer = 0;
  bool follows = false;  // the window before it in the group is of the same clip
  std::array<int, band_count + 1> edges{};
  int functions = 0;
};
// A run of windows that is coded by itself.
struct WindowGroup {
  std::size_t first = 0;
  std::size_t count = 0;
};
struct WindowLayout {
  std::vector<WindowPlace> windows;  // clip by clip
  std::vector<WindowGroup> groups;
  std::vector<std::size_t> first_of_clip;  // and the end
};
[[nodiscard]] WindowLayout lay_out(const ClipTable& table, const Spectrum& spectrum, int group_frames);

// Tables of natural functions by size, made when first needed; forgotten when they take more than 32 MiB. Safe from
// several threads.
class FunctionTables {
 public:
  [[nodiscard]] std::shared_ptr<const NaturalFunctions> get(int points, int functions);

 private:
  std::mutex mutex_;
  std::map<std::pair<int, int>, std::shared_ptr<const NaturalFunctions>> tables_;
  std::size_t bytes_ = 0;
};

// L0: the Cholesky factor of the position metric at the reference pose, as every reader computes it.
[[nodiscard]] Eigen::MatrixXd metric_at_rest(const ReferencePose& reference, const Skeleton& skeleton,
                                             double shell_weight);

// From coefficients in quantiser steps to pose vectors. Same bits on every machine.
class WindowSynthesis {
 public:
  // `skeleton`: the first of the stream.
  WindowSynthesis(const PoseSpaceTables& tables, const Skeleton& skeleton);

  [[nodiscard]] const Eigen::MatrixXd& basis() const { return basis_; }  // B, dimensions x components

  struct Scratch {
    std::vector<double> coefficients;
    std::vector<double> sums;
  };
  // values: [component][functions]; out: [dimension][points].
  void synthesise(const WindowPlace& window, std::span<const double> values, std::span<double> out,
                  Scratch& scratch) const;

 private:
  Eigen::MatrixXd basis_;
  double step_;
  std::unique_ptr<FunctionTables> functions_ = std::make_unique<FunctionTables>();
};

}  // namespace kinespace
