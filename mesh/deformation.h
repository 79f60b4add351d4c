// Geometric details from a key-frame onto the low-frequency part of another frame.
//
// Given the key-frame k, its low-frequency part k_low = U U^+ k and another frame's low-frequency part x_low = U c,
// what was done to k_low is done to k:
//
//   poisson    deformation transfer (sumner and popovic 2004; chen2019 section 3.3): each triangle's deformation
//              gradient S_t from k_low to x_low, then the mesh whose gradients from k come closest to the S_t, weighted
//              by area (botsch 2006 shows that to be sumner's system): one sparse factorisation for the key-frame, one
//              substitution for a frame. Each connected component is placed so that its centroid is that of x_low,
//              which is the true one when U holds the constants. Where a triangle of k_low degenerates (fingers,
//              hooves) its gradient means nothing: it gives way to the rotation of its vertices' surroundings.
//   rotations  x_v = x_low_v + R_v (k_v - k_low_v), R_v the rotation of the 1-ring of v from k_low to x_low. No system,
//              and on articulated motion closer than poisson.
//
// Either is exact for a rigid motion, to 1e-8 of the size. Both leave a low-frequency error, which costs no bits to
// remove:
//
//   x <- x + U (c - U^+ x)       (correct_low_frequencies)
//
// The result is the same to the last bit on every machine, for the same inputs.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh/mesh_sequence.h"
#include "kinespace/mesh/projection.h"
#include "kinespace/mesh/sparse_solver.h"

namespace kinespace {

// The affine map's linear part that takes a triangle, and the normal of length sqrt(2 area), to another (sumner 2004,
// eq. 3 and 4). Nothing useful for a triangle without area; finite always.
using Corners = Eigen::Matrix3d;  // a column a vertex
[[nodiscard]] Eigen::Matrix3d deformation_gradient(const Corners& from, const Corners& to);

// The rotation of every vertex's 1-ring. The identity for a vertex without neighbours.
[[nodiscard]] std::vector<Eigen::Matrix3d> ring_rotations(const Neighbours& neighbours, const Points& from,
                                                          const Points& to);

enum class TransferMethod : std::uint8_t { none, poisson, rotations };  // none: x = x_low

class DetailTransfer {
 public:
  // `key` and `key_low` have a row for each vertex.
  DetailTransfer(Points key, Points key_low, std::span<const Triangle> triangles, TransferMethod method);

  [[nodiscard]] TransferMethod method() const { return method_; }
  // The frame with details, without the low-frequency correction. May be called from several threads.
  [[nodiscard]] Points apply(const Points& frame_low) const;

 private:
  struct Element {                          // a triangle of the key-frame
    Eigen::Matrix<double, 3, 2> gradients;  // of its second and third hat function, times its area
    bool degenerate;                        // its low-frequency part is
  };
  [[nodiscard]] Points with_rotations(const Points& frame_low) const;
  [[nodiscard]] Points with_poisson(const Points& frame_low) const;
  void prepare_poisson();
  void place_components(const Points& frame_low, Points& x) const;

  Points key_, key_low_, detail_;
  std::vector<Triangle> triangles_;
  TransferMethod method_;
  Neighbours neighbours_;
  Components components_;
  std::vector<Element> elements_;
  std::unique_ptr<SparseSolver> solver_;
};

// x + U (c - U^+ x).
[[nodiscard]] Points correct_low_frequencies(Points x, const Coefficients& c, const Projection& space);

}  // namespace kinespace
