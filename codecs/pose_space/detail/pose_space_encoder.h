// The encoder of the motion-space codec, in steps that a search for a target repeats: prepare once, plan for a metric
// and a rough step, then attempt at a step. Private to this folder.
#pragma once

#include <span>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/codecs/pose_space/pose_space_basis.h"
#include "kinespace/codecs/pose_space/pose_space_tables.h"
#include "kinespace/codecs/stream/clip_error.h"

namespace kinespace {

struct PoseSpaceSettings {
  double shell_weight = 0.03;
  double rate_weight = 0.18;  // lambda: squared steps that a bit is worth. dD/dR of white noise is 0.1155 at high rates
  double window_s = 0;        // fixed windows of so many seconds; 0: as time_blocks.h plans
  int group_frames = 4096;
  int sample = 1;               // every so many groups only, for estimates
  bool all_components = false;  // those that do not pay too
};

// The result of coding at one step.
struct Attempt {
  PoseSpaceTables tables;
  int rung = 0;  // of the shared basis, where there is one
  ClipTable clips;
  WindowLayout layout;
  std::vector<std::vector<Bytes>> groups;  // [group][layer]; empty for groups that were not sampled
  ClipErrorSums error;                     // of the groups coded
  std::vector<double> largest;             // by window: the largest joint error, when asked for
};

class PoseSpaceEncoder {
 public:
  // `basis`: what the stream shares; nullptr: tables of its own. Throws Error as Codec::encode does.
  PoseSpaceEncoder(std::span<const Clip> clips, const Progress& progress, const PoseSpaceBasis* basis);

  // Cuts the clips into windows and transforms them, for about this step.
  void plan(double step, const PoseSpaceSettings& settings);
  // The same windows with another shell weight.
  void weigh_again(const PoseSpaceSettings& settings);
  // Codes at a step. `learned`: an attempt at a step near it, whose models are the start. `finer`: by window.
  [[nodiscard]] Attempt attempt(double step, const PoseSpaceSettings& settings, const Attempt* learned,
                                std::span<const int> finer = {}) const;
  [[nodiscard]] std::size_t window_count() const { return first_window_.back(); }
  [[nodiscard]] std::int64_t frames() const { return frames_; }
  [[nodiscard]] const std::vector<Skeleton>& skeletons() const { return table_.skeletons; }
  // The finished stream, with the error of what a reader decodes from it.
  [[nodiscard]] Bytes finish(const Attempt& attempt) const;

 private:
  struct Coding;
  struct Window {
    std::size_t clip = 0;
    int first = 0;
    int points = 0;
  };
  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  // [dimension][function], all functions of the pose vectors.
  using Coefficients = Eigen::Map<const RowMatrix, 0, Eigen::OuterStride<>>;

  void take_vectors();
  void cut(std::size_t clip, double step, const PoseSpaceSettings& settings);
  void weigh(double shell_weight);
  void transform();
  void measure_energies();
  [[nodiscard]] Coefficients coefficients(std::size_t window) const;
  [[nodiscard]] int active_functions(std::size_t window, double step) const;
  [[nodiscard]] Eigen::VectorXd gains(double step, const WindowLayout& layout,
                                      std::span<const std::size_t> windows) const;
  void choose_basis(const WindowLayout& layout, std::span<const std::size_t> windows, bool all,
                    PoseSpaceTables& tables) const;
  void code_groups(Coding& coding, const PoseSpaceSettings& settings, bool measure) const;

  std::span<const Clip> clips_;
  const Progress& progress_;
  const PoseSpaceBasis* basis_;
  ClipTable table_;
  ReferencePose reference_;
  // A clip's pose vectors; once there is a plan, their coefficients instead, each window's where its frames were: the
  // two together would take as much as the clips do.
  std::vector<PoseVectors> vectors_;
  std::int64_t frames_ = 0;
  Eigen::MatrixXd moments_;  // mean of x x'
  PoseMetric metrics_;       // mean over sampled poses
  Eigen::MatrixXd metric_;
  KarhunenLoeve exact_;
  std::vector<Window> windows_;                // of the plan, clip by clip
  std::vector<std::size_t> first_window_;      // by clip, and the end
  std::vector<std::vector<double>> energies_;  // by window and function: what it moves, squared, in the metric
};

// How far what a reader decodes from a stream is from the clips that it was made of. Holds the clips of a few groups of
// windows at a time, not all.
[[nodiscard]] ClipErrorSums decoded_error(std::span<const std::byte> stream, std::span<const Clip> originals,
                                          const PoseSpaceBasis* basis);

}  // namespace kinespace
