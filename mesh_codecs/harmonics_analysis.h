// mesh-harmonics, standard profile: a sequence in the coordinates of one key-frame and its functions, to be coded with
// any step.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "kinespace/mesh/decimation.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh_codecs/harmonics_stream.h"

namespace kinespace {

// Step of the key-frame's grid over the root mean square error a coordinate that is asked for.
inline constexpr double harmonics_key_steps = 2.2;

struct HarmonicsSettings {
  int key = 0;          // the key-frame
  int functions = 0;    // K
  double key_step = 1;  // grid of the key-frame, in the mesh's unit
  bool rotate = true;   // details turn with the surface
  FrameTransform transform = FrameTransform::components;
  bool eigenvectors = false;  // for estimates only: streams of them are not made
};

class HarmonicsAnalysis {
 public:
  // `decimation`: of `mesh`, canonical triangles. Both `mesh` and `progress` must outlive the analysis.
  HarmonicsAnalysis(const MeshSequence& mesh, const std::optional<Decimation>& decimation,
                    const HarmonicsSettings& settings, const Progress& progress);

  struct Attempt {
    double squared_error = 0;           // of the vertices that are coded, before rounding to floats
    std::int64_t bytes = 0;             // of coefficients and residuals
    std::int64_t numbers = 0;           // that a reader makes of them
    std::vector<Bytes> motion, detail;  // by block
    double step = 0;
  };
  // Quick: residuals as if the coefficients were not rounded, which changes little; the figures are close, no more.
  [[nodiscard]] Attempt estimate(double step) const { return code(step, false, nullptr); }

  // All that a stream holds but what it says about itself, and what it decodes to.
  struct Trial {
    Attempt attempt;
    MeshSequence decoded;
    double kg = 0;
  };
  [[nodiscard]] Trial encode(double step) const;
  // Bytes of a trial's stream, or a little more: its measured error is not known yet.
  [[nodiscard]] std::int64_t size(const Trial& trial) const;
  // The stream of a trial, with its whole measured error: lr takes as long as coding.
  [[nodiscard]] Bytes finish(const Trial& trial) const;

  void set_transform(FrameTransform transform) { settings_.transform = transform; }
  [[nodiscard]] double coded_vertices() const { return coded().vertices; }
  // Of the parts that do not depend on the step.
  [[nodiscard]] std::int64_t fixed_bytes() const;
  // Squared sum of what the functions leave out of the frames.
  [[nodiscard]] double residual_energy() const;

 private:
  struct BlockTables {
    Eigen::MatrixXd coefficients, residuals;
    std::unique_ptr<PartCoder> motion, detail;
  };
  [[nodiscard]] const MeshSequence& coded() const { return coarse_ ? *coarse_ : mesh_; }
  void align();
  void pack_key();
  void find_coefficients();
  void find_residuals();
  [[nodiscard]] Attempt code(double step, bool exact, HarmonicsFrames* frames) const;
  [[nodiscard]] Coefficients true_coefficients(const BlockTables& block, int at) const;
  template <typename Which>
  [[nodiscard]] Eigen::MatrixXd residual_table(int block, const Which& coefficients) const;
  [[nodiscard]] Bytes stream_of(const Attempt& attempt, const MeshError& error) const;

  const MeshSequence& mesh_;
  std::optional<Decimation> decimation_;
  std::optional<MeshSequence> coarse_;
  HarmonicsSettings settings_;
  const Progress& progress_;
  HarmonicsSetup setup_;
  FrameBlocks split_;
  RigidTrack track_;
  Bytes track_bytes_;
  PackedKeyMesh packed_;
  std::int64_t connectivity_ = 0;
  std::vector<Points> aligned_;
  std::shared_ptr<const HarmonicsSpace> space_;
  std::shared_ptr<const Refinement> refinement_;
  std::vector<BlockTables> blocks_;
};

}  // namespace kinespace
