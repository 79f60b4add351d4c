// Smooth functions on a mesh that come from linear solves, and so are the same to the last bit on every machine.
//
// Manifold harmonics (mesh/harmonics.h) are eigenvectors: another compiler may turn them. This basis spans what splines
// span: around each of a number of anchor vertices a, the function
//
//   (S + e I)^-p delta_a       (least-squares meshes and geometry-aware bases, sorkine 2004 and 2005: p = 2)
//
// with the cotangent stiffness S of mesh/laplacian.h and a tiny e, p = 3 here (triharmonic: closer to the harmonics),
// and one constant for each connected component. Anchors are chosen in rounds (sorkine 2005), where the mesh itself is
// far from its projection on the functions found so far and where other anchors are far along its edges. A decoder that
// has the mesh finds the same anchors, so they cost no bits.
//
// The functions are orthonormal (U' U = I, no masses: KG does not weigh by area), coarse ones first. Projection on
// them: mesh/projection.h. The KG error of projecting real sequences on them, against as many harmonics: 5 to 18 %
// lower for articulated motion, up to 10 % higher for cloth.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

struct SmoothBasisOptions {
  int functions = 400;  // K, 1 to the number of vertices
  int order = 3;        // p, 1 to 4: 2 is cheaper and farther from the harmonics

  // Throws Error{usage} naming field, value and legal range.
  void validate(int vertices) const;
};

struct SmoothBasis {
  Eigen::MatrixXd functions;          // U: a row for each vertex, a column for each function
  std::vector<std::int32_t> anchors;  // of the functions after the constants

  [[nodiscard]] int count() const { return static_cast<int>(functions.cols()); }
};

// `points`: a row for each vertex; indices of triangles in range. Throws Error{usage} for options out of range. With
// more components than functions the largest components get theirs.
[[nodiscard]] SmoothBasis smooth_basis(const Points& points, std::span<const Triangle> triangles,
                                       const SmoothBasisOptions& options = {});

}  // namespace kinespace
