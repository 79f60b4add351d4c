// What encoder and decoder of mesh-harmonics (standard profile) both make from a decoded key-frame.
//
//   U        smooth functions on the key-frame (mesh/smooth_basis.h), the same everywhere
//   frame    x = U (c - U' d) + d,   d_v = R_v (key_v - (U U' key)_v + residual_v)
//
// c: the coded coefficients of the frame; R_v: the rotation of the 1-ring of v from U U' key to U c (or none): details
// of the key-frame turn with the surface. The parts in and outside of the functions' space are orthogonal, so the error
// is the coefficients' error plus the residual's.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "codecs/mesh/node_coder.h"
#include "mesh/connectivity.h"
#include "mesh/mesh_sequence.h"
#include "mesh/projection.h"

namespace kinespace {

class HarmonicsSpace {
 public:
  HarmonicsSpace(Points key, std::span<const Triangle> triangles, int functions);

  [[nodiscard]] const Projection& projection() const { return projection_; }
  [[nodiscard]] const Coefficients& key_coefficients() const { return key_coefficients_; }
  [[nodiscard]] int functions() const { return projection_.functions(); }
  [[nodiscard]] int vertices() const { return projection_.vertices(); }
  [[nodiscard]] const NodeGraph& function_graph() const { return function_graph_; }
  [[nodiscard]] const NodeGraph& vertex_graph() const { return vertex_graph_; }

  // The frame of these coefficients; `residual`: three numbers a vertex, or none.
  [[nodiscard]] Points frame(const Coefficients& c, bool rotate, std::span<const double> residual) const;
  // The residual with which frame() gives what it can of `wanted`. `c`: as the decoder has them.
  void residual(const Points& wanted, const Coefficients& c, bool rotate, std::span<double> out) const;

 private:
  struct Basis;
  HarmonicsSpace(Points key, std::span<const Triangle> triangles, const Basis& basis);
  [[nodiscard]] std::vector<Eigen::Matrix3d> rotations(const Points& low, bool rotate) const;

  Projection projection_;
  Neighbours neighbours_;
  Coefficients key_coefficients_;
  Points key_low_, detail_;
  NodeGraph function_graph_, vertex_graph_;
};

}  // namespace kinespace
