// The smallest eigenpairs of a sparse symmetric positive semi-definite matrix (of one connected mesh, here).
//
// Band by band (vallet and levy 2008, section 4): around one shift after another, each beyond the last, Lanczos with
// the inverse of A - shift I (Spectra) finds a few dozen pairs; the time of one wide Lanczos process grows with the
// square of their number, that of bands does not. How many eigenvalues lie below a number is known exactly, from the
// signs of the pivots of a factorisation there (Sylvester's law of inertia). So no pair is missed: copies of a multiple
// eigenvalue that Lanczos did not see are sought again beside those it saw.
//
// Everything runs in one thread: the same build gives the same bits.
#pragma once

#include <Eigen/Core>

#include "kinespace/mesh/laplacian.h"

namespace kinespace {

struct Eigenpairs {
  Eigen::MatrixXd vectors;  // orthonormal columns
  Eigen::VectorXd values;   // ascending
};

// `tolerance`: of the eigenvalues, relative. `count`: 1 to a half of the rows, of which there are hundreds: for more
// of them a dense solver is as good. Throws Error{machine} when the process does not converge.
[[nodiscard]] Eigenpairs smallest_eigenpairs(const SparseMatrix& matrix, int count, double tolerance);

// The same by a dense solver, any count and size.
[[nodiscard]] Eigenpairs smallest_eigenpairs_dense(const SparseMatrix& matrix, int count);

}  // namespace kinespace
