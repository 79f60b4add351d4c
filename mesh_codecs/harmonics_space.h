// What encoder and decoder of mesh-harmonics (standard profile) both make from a decoded key-frame.
//
//   U        smooth functions on the key-frame (mesh/smooth_basis.h), the same everywhere
//   frame    x = U c + d,   d_v = R_v (key_v - (U U' key)_v + residual_v)
//
// c: the coded coefficients of the frame; R_v: the rotation of the 1-ring of v from U U' key to U c (or none): details
// of the key-frame turn with the surface. What d has inside the functions' space is known to the encoder, which takes
// it off the coefficients before it codes them: the low-frequency correction of mesh/deformation.h costs no decoding
// then.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh/mesh_sequence.h"
#include "kinespace/mesh/projection.h"
#include "kinespace/mesh_codecs/node_coder.h"

namespace kinespace {

class BasisCache;

class HarmonicsSpace {
 public:
  // With the eigenvectors of mesh/harmonics.h in place of the smooth functions: for comparison, since a stream of them
  // could be read by the build that made it only.
  [[nodiscard]] static std::shared_ptr<const HarmonicsSpace> of_eigenvectors(Points key,
                                                                             std::span<const Triangle> triangles,
                                                                             int functions);

  // `cache`: where the functions may be kept (basis_cache.h), or none.
  HarmonicsSpace(Points key, std::span<const Triangle> triangles, int functions, BasisCache* cache = nullptr);

  [[nodiscard]] const Projection& projection() const { return projection_; }
  [[nodiscard]] const Coefficients& key_coefficients() const { return key_coefficients_; }
  [[nodiscard]] int functions() const { return projection_.functions(); }
  [[nodiscard]] int vertices() const { return projection_.vertices(); }
  [[nodiscard]] const NodeGraph& function_graph() const { return function_graph_; }
  [[nodiscard]] const NodeGraph& vertex_graph() const { return vertex_graph_; }

  // U U' key.
  [[nodiscard]] const Points& key_low() const { return key_low_; }
  // The frame of a low-frequency part U c; `residual`: three numbers a vertex, or none.
  [[nodiscard]] Points frame(const Points& low, bool rotate, std::span<const double> residual) const;
  // The coefficients with which frame() is closest to `wanted`, nearly: one step of the fixed-point iteration. The
  // details they bring change little with them, and further steps lowered no stream's size by more than 0.2 %.
  [[nodiscard]] Coefficients coefficients(const Points& wanted, bool rotate) const;
  // What is missing of `wanted` outside the functions' space, turned back. `c`: as the decoder has them.
  void residual(const Points& wanted, const Coefficients& c, bool rotate, std::span<double> out) const;

 private:
  struct Basis;
  HarmonicsSpace(Points key, std::span<const Triangle> triangles, Basis basis);
  [[nodiscard]] std::vector<Eigen::Matrix3d> rotations(const Points& low, bool rotate) const;

  Projection projection_;
  Neighbours neighbours_;
  Coefficients key_coefficients_;
  Points key_low_, detail_;
  NodeGraph function_graph_, vertex_graph_;
};

}  // namespace kinespace
