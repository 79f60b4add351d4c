// The encoder of the default profile, in steps that a search for a target repeats: prepare once, plan for a rough step,
// then attempt at a step.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/codecs/pose_space/joint_basis.h"
#include "kinespace/codecs/pose_space/time_blocks.h"
#include "kinespace/codecs/rma/contact_trajectories.h"
#include "kinespace/codecs/rma/detail/repeat_stream.h"
#include "kinespace/codecs/rma/markers.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/repeats/repeats.h"

namespace kinespace {

struct RepeatAttempt {
  RepeatTables tables;
  ClipTable clips;
  std::vector<Bytes> groups;
  ClipErrorSums error;
};

// Slow joints only, and no step of theirs that the eye would miss: half of the bytes of the paper's rule.
inline constexpr ContactOptions slow_contacts{.near_cm = 0, .still_cm = 0.6};

class RepeatEncoder {
 public:
  struct Preparation {
    bool repeats = true;
    bool contacts = true;
    double shell_weight = 0.01;  // of the metric (codecs/pose_space/position_metric.h)
    double rate_weight = 0.18;   // squared steps that a bit is worth
  };
  // Throws Error as Codec::encode does.
  RepeatEncoder(std::span<const Clip> clips, const Preparation& preparation, const Progress& progress);

  // Cuts clips into windows and looks for their predictions, for about this step.
  void plan(double step);
  [[nodiscard]] RepeatAttempt attempt(double step, bool predict) const;
  // Whether the plan predicts any window.
  [[nodiscard]] bool predicts() const;
  [[nodiscard]] const RepeatAnalysis& analysis() const { return analysis_; }

 private:
  struct Coding;
  void add_statistics();
  void cut(std::size_t clip, double step);
  void find_predictions(double step);
  [[nodiscard]] WindowPrediction candidate(std::size_t w) const;
  [[nodiscard]] std::vector<double> predicted_from_originals(std::size_t w, const WindowPrediction& prediction) const;
  void choose_basis(double step, PoseSpaceTables& tables) const;
  [[nodiscard]] std::vector<double> own_vectors(std::size_t w) const;
  // Coefficients of vectors [dimension][points] under a projection: [component][functions of the window].
  [[nodiscard]] std::vector<double> analyse(std::size_t w, std::span<const double> vectors,
                                            const Eigen::MatrixXd& projection) const;
  void code(Coding& coding, bool is_predicted, bool final) const;
  void measure(Coding& coding) const;

  std::span<const Clip> clips_;
  const Progress& progress_;
  Preparation preparation_;
  AlignedClips aligned_;
  ClipTable table_;
  RepeatAnalysis analysis_;
  std::vector<std::int64_t> starts_;  // by clip: its first frame in the analysis
  Eigen::MatrixXd metric_;
  KarhunenLoeve exact_;
  // By plan.
  std::vector<WindowPlace> windows_;
  std::vector<std::size_t> first_of_clip_;
  std::vector<bool> jumps_;
  std::vector<WindowPrediction> predictions_;
  std::vector<std::shared_ptr<const WindowTransform>> transforms_;  // by window
  std::vector<std::vector<ContactTrack>> contacts_;
};

[[nodiscard]] Bytes write_repeat_stream(const RepeatAttempt& attempt, const MeasuredError& error);

}  // namespace kinespace
