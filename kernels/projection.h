// Projection onto a basis and reconstruction from it, for many curves at once.
//
//   project:      scores = (Y - mean) P      Y: n x T curves, P: T x k (for a consistent space P = W Phi)
//   reconstruct:  Y = mean + S Phi'          S: n x k scores, Phi: T x k functions
//
// In double on the processor (BLAS), in float there or on an OpenCL device; float is exact to about T 6e-8 of the
// largest product |y - mean| |p|. The result does not depend on threads.
#pragma once

#include "kinespace/kernels/device.h"
#include "kinespace/kernels/matrix.h"

namespace kinespace {

// Throw Error{usage} when the sizes do not fit.
[[nodiscard]] RowMatrix<float> project(const RowMatrixView<float>& curves, const Eigen::VectorXf& mean,
                                       const RowMatrixView<float>& projection, const Compute& compute = {});
[[nodiscard]] RowMatrix<double> project(const RowMatrixView<double>& curves, const Eigen::VectorXd& mean,
                                        const RowMatrixView<double>& projection);
[[nodiscard]] RowMatrix<float> reconstruct(const RowMatrixView<float>& scores, const Eigen::VectorXf& mean,
                                           const RowMatrixView<float>& functions, const Compute& compute = {});
[[nodiscard]] RowMatrix<double> reconstruct(const RowMatrixView<double>& scores, const Eigen::VectorXd& mean,
                                            const RowMatrixView<double>& functions);

namespace reference {
// Plain loops, sums in double.
[[nodiscard]] RowMatrix<float> project(const RowMatrixView<float>& curves, const Eigen::VectorXf& mean,
                                       const RowMatrixView<float>& projection);
[[nodiscard]] RowMatrix<float> reconstruct(const RowMatrixView<float>& scores, const Eigen::VectorXf& mean,
                                           const RowMatrixView<float>& functions);
}  // namespace reference

}  // namespace kinespace
