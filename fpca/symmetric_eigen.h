// Eigenvalues of a symmetric matrix, all of them, and the eigenvectors of the largest.
//
// In two steps, because how many vectors are wanted is known only once the values are. For this folder and synthesis.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace kinespace {

class SymmetricEigen {
 public:
  // Decomposes `matrix` (its lower triangle is read). Values in descending order, accurate to rounding of the largest.
  // Throws Error{machine} when LAPACK does not converge.
  const Eigen::VectorXd& decompose(const Eigen::MatrixXd& matrix);

  // The eigenvectors of the `count` largest values of the matrix last decomposed, as columns: orthonormal to 1e-14 or
  // so. Their signs are LAPACK's.
  const Eigen::MatrixXd& vectors(int count);

 private:
  void select_vectors(int count);
  void orthonormalise();

  int size_ = 0;
  Eigen::MatrixXd reflectors_;  // Householder vectors of the reduction to tridiagonal form
  Eigen::VectorXd tau_, diagonal_, below_, values_, scratch_values_, scratch_diagonal_, scratch_below_;
  Eigen::MatrixXd vectors_;
  std::vector<double> work_;
  std::vector<int> integers_, support_;
};

}  // namespace kinespace
