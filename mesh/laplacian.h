// The Laplacian of a mesh, and its masses.
//
// Stiffness matrix S = -L (chen2019 eq. 3 and 4, with the factor 1/2 that makes it the Dirichlet energy's matrix):
//
//   S_ij = -w_ij for an edge ij,   S_ii = sum over j of w_ij
//
// symmetric, positive semi-definite; its null space is one constant a connected component. The eigenproblem of the
// paper, -L phi = lambda M phi, is S phi = lambda M phi.
//
//   cotangent  w_ij = sum over the triangles at the edge of cot(angle opposite it) / 2 (pinkall 1993). A triangle whose
//              doubled area is below `flatness` times its longest edge squared is treated as if its area were that: all
//              three weights shrink together, which keeps the matrix semi-definite, and no |cot| is above 1 / flatness.
//              A triangle of no size at all adds nothing.
//   uniform    w_ij = 1 for every edge, once, however many triangles it has.
//   mass       a third of the area of its triangles for each vertex (barycentric, lumped). A vertex gets at least 1e-6
//              times the mean mass, so that M can be inverted where vertices have no area; 1 for all when nothing has.
//
// A triangle with a vertex twice adds nothing to cotangents and masses. Duplicate and non-manifold triangles add up.
#pragma once

#include <span>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

using SparseMatrix = Eigen::SparseMatrix<double>;

inline constexpr double cotangent_flatness = 1e-3;

// `points` has a row for each vertex; the indices of the triangles must be in range.
[[nodiscard]] SparseMatrix cotangent_stiffness(const Points& points, std::span<const Triangle> triangles,
                                               double flatness = cotangent_flatness);
[[nodiscard]] SparseMatrix uniform_stiffness(int vertices, std::span<const Triangle> triangles);
[[nodiscard]] Eigen::VectorXd lumped_mass(const Points& points, std::span<const Triangle> triangles);

}  // namespace kinespace
