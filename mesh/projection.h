// Positions in a space of functions on the mesh: least-squares coefficients, and back.
//
//     c = U^+ x    minimises |x - U c|, and with it the KG error (chen2019 eq. 5 and 8, for any basis)
//
// The functions are kept as 32-bit floats in blocks of vertices, so that a frame of a basis of 400 functions streams
// 4 bytes a number; products accumulate in doubles in a written order and give the same bits on every machine for the
// same functions. Functions that are not orthonormal (area-weighted harmonics) are made so first: the space is the
// same, coefficients belong to the orthonormal functions (Q of a QR decomposition, which is as portable as U is).
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

// A row for each function.
using Coefficients = Eigen::Matrix<double, Eigen::Dynamic, 3>;

class Projection {
 public:
  // `functions`: a row for each vertex, a column for each function, linearly independent.
  explicit Projection(const Eigen::MatrixXd& functions);

  [[nodiscard]] int vertices() const { return vertices_; }
  [[nodiscard]] int functions() const { return functions_; }

  // c = U^+ x. U of rounded numbers is orthonormal to 1e-6 only: a second step with the rest makes c exact to 1e-12.
  [[nodiscard]] Coefficients coefficients(const Points& x) const;
  // x = U c.
  [[nodiscard]] Points synthesise(const Coefficients& c) const;
  // x += U c. `c` may have fewer rows than there are functions: the first ones are taken.
  void add(const Coefficients& c, Points& x) const;
  // U' x: one step of `coefficients`, exact to 1e-6.
  [[nodiscard]] Coefficients correlations(const Points& x) const;

 private:
  int vertices_ = 0, functions_ = 0;
  std::vector<float> blocks_;  // [block][function][vertex of block]
};

}  // namespace kinespace
