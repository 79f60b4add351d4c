// A table of what moves, coded: three numbers for each node (a function or a vertex) in each frame, as sums of a few
// functions of time (principal components or cosines; frame_basis.h) with quantised weights (node_coder.h).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "kinespace/base/bytes.h"
#include "kinespace/mesh_codecs/frame_basis.h"
#include "kinespace/mesh_codecs/node_coder.h"

namespace kinespace {

enum class FrameTransform : std::uint8_t { components = 0, cosines = 1 };

// Decoded.
struct MovingPart {
  Eigen::MatrixXd functions;   // frames x components
  std::vector<float> weights;  // [component][node][axis]
  int nodes = 0;

  // Adds the 3 * nodes numbers of a frame to `out`.
  void add(int frame, std::span<double> out) const;
};

struct PartOptions {
  double step = 1;
  FrameTransform transform = FrameTransform::components;
  double rate_weight = 0.12;  // squared steps a bit
  double coarseness = 1;      // of the components over time, in steps
};

struct CodedPart {
  Bytes bytes;
  MovingPart part;
  double squared_error = 0;
};

// Codes one table several times: what does not depend on the options is done once.
class PartCoder {
 public:
  // `table`: a column for each frame, 3 * graph.nodes() rows. Both must outlive the coder.
  PartCoder(const Eigen::MatrixXd& table, const NodeGraph& graph);
  [[nodiscard]] CodedPart code(const PartOptions& options) const { return code(options, table_, energy_); }
  // Another table that differs little, in the components of this one.
  [[nodiscard]] CodedPart code(const PartOptions& options, const Eigen::MatrixXd& table) const {
    return code(options, table, table.squaredNorm());
  }

  // Squared sum of the table.
  [[nodiscard]] double energy() const { return energy_; }

 private:
  [[nodiscard]] CodedPart code(const PartOptions& options, const Eigen::MatrixXd& table, double energy) const;
  // How many functions of time have a weight that is worth coding, to the last such.
  [[nodiscard]] int worth_coding(FrameTransform transform, double step) const;

  const Eigen::MatrixXd& table_;
  const NodeGraph& graph_;
  PrincipalComponents components_;
  Eigen::VectorXd component_peaks_, cosine_peaks_;  // largest weight of each function
  double energy_ = 0;
};

// Throws Error{bad_input} naming `source`; also for a table of more than `most_numbers` weights.
[[nodiscard]] MovingPart decode_part(std::span<const std::byte> bytes, int frames, const NodeGraph& graph, double step,
                                     std::int64_t most_numbers, const std::string& source);

}  // namespace kinespace
