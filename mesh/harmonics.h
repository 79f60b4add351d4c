// Manifold harmonics: the smoothest functions on a mesh (vallet and levy 2008; chen2019 section 3.2.1).
//
//     S phi_k = lambda_k M phi_k,   0 = lambda_1 <= lambda_2 <= ... <= lambda_K
//
// with S and M of mesh/laplacian.h, or M = I, which gives a lower KG error for the same K (KG does not weigh by area).
// The functions are M-orthonormal: U' M U = I. Coefficients of positions are therefore U' M f (not U' f, as the paper
// prints); the least-squares ones, which minimise the KG error, are those of mesh/projection.h.
//
// How: mesh/detail/eigenpairs.h, component by component (Spectra, in bands): 400 functions on 8431 vertices take a second.
// The same build gives the same bits on every run and with any number of threads. Another build, compiler or processor
// may not: nearly equal eigenvalues rotate their vectors, and signs flip. The sign is made canonical (the component of
// largest size is positive, the first such within 1e-6 of it), which helps against flips only. So a stream that relies
// on these functions carries `basis_checksum` and is read only where that agrees; smooth_basis.h has functions that
// every machine computes alike.
#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

struct HarmonicsOptions {
  int functions = 400;         // K, 1 to the number of vertices
  bool area_weighted = false;  // M: lumped areas (the paper), or the identity
  double tolerance = 1e-9;     // of the eigenvalues, relative; 1e-14 to 1e-2

  // Throws Error{usage} naming field, value and legal range.
  void validate(int vertices) const;
};

struct Harmonics {
  Eigen::MatrixXd functions;    // U: a row for each vertex, a column for each function, smoothest first
  Eigen::VectorXd eigenvalues;  // ascending, >= 0; in 1 / unit^2 when area-weighted
  Eigen::VectorXd mass;         // the diagonal of M

  [[nodiscard]] int count() const { return static_cast<int>(functions.cols()); }
};

// Throws Error{usage} for options out of range and Error{machine} when the eigenproblem does not converge. Meshes of
// any kind are taken: several components and isolated vertices give as many functions of eigenvalue 0.
[[nodiscard]] Harmonics manifold_harmonics(const Points& points, std::span<const Triangle> triangles,
                                           const HarmonicsOptions& options = {});

// 64 bits that tell one basis from another: XXH3 of the numbers' bits, and of the shape.
[[nodiscard]] std::uint64_t basis_checksum(const Eigen::MatrixXd& functions);

}  // namespace kinespace
