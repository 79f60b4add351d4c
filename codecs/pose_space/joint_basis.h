// The decorrelation across joints: pose vectors as sums of a few poses, x = B z.
//
//   B = L0^-T V
//
// L0 L0' is the position metric at the reference pose (position_metric.h), which the decoder computes for itself, and V
// is sent, in whole multiples of a power of two for each column, finer for columns that carry much. V is what makes B
// the Karhunen-Loeve basis of the clips' poses in the metric averaged over the clips: then white noise in z is white
// noise in joint positions, and the energy stands in the first components. V need not be exact: the encoder projects on
// the B that the decoder has.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "kinespace/base/bytes.h"
#include "kinespace/codecs/pose_space/position_metric.h"

namespace kinespace {

struct JointBasis {
  int dimensions = 0;
  int components = 0;
  std::vector<std::int8_t> exponents;  // by component: V's entries are multiples of 2^-exponent, 0 to 20
  std::vector<std::int32_t> entries;   // [component][dimension]

  // V as the decoder has it, dimensions x components.
  [[nodiscard]] Eigen::MatrixXd mixing() const;
};

[[nodiscard]] JointBasis quantise_basis(const Eigen::MatrixXd& mixing, std::span<const int> exponents);
[[nodiscard]] Bytes pack_basis(const JointBasis& basis);
// Throws Error{bad_input} naming `source`.
[[nodiscard]] JointBasis unpack_basis(std::span<const std::byte> bytes, int dimensions, int components,
                                      const std::string& source);

// What encoders plan with: the exact basis of second moments C of pose vectors in the metric M.
struct KarhunenLoeve {
  Eigen::MatrixXd basis;   // B, dimensions x dimensions: B' M B = I, columns by falling energy
  Eigen::VectorXd energy;  // mean square of each component
};
// Columns `kept` of the exact basis as V is sent, for a quantiser of that step: fine enough that a component of that
// energy leaks less than a step into the others, and never so coarse that columns of unit length lose their shape.
// `lower`: L0.
[[nodiscard]] JointBasis sent_basis(const KarhunenLoeve& exact, std::span<const int> kept, double step,
                                    const Eigen::MatrixXd& lower);
[[nodiscard]] KarhunenLoeve karhunen_loeve(const Eigen::MatrixXd& metric, const Eigen::MatrixXd& second_moments);

// The least squares projection onto B in the metric M: z = P x.
[[nodiscard]] Eigen::MatrixXd projection_onto(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& metric);

}  // namespace kinespace
