// Orthonormal functions of the frame number, in which what moves is coded.
//
// Cosines (DCT-II) are known to both sides. Principal components are the sequence's own: each is coded as cosine
// coefficients in steps of 2^-e, and what the decoder gets is made orthonormal again (Gram-Schmidt), so that rounding
// turns the space a little but never stretches it. Sums, products, quotients and roots in a written order only: the
// same bits on every machine.
#pragma once

#include <span>
#include <string>

#include <Eigen/Core>

#include "kinespace/base/bytes.h"

namespace kinespace {

// A column for each cosine, slowest first; frames x frames.
[[nodiscard]] Eigen::MatrixXd cosine_basis(int frames);

struct CodedFrameBasis {
  Bytes bytes;
  Eigen::MatrixXd functions;  // frames x components, as decode_frame_basis gives them
};
// `functions`: orthonormal columns. `sizes`: of what each is multiplied with, in quantiser steps: the larger, the finer
// a column is coded. `coarseness`: the step of a column times its size.
[[nodiscard]] CodedFrameBasis encode_frame_basis(const Eigen::MatrixXd& functions, std::span<const double> sizes,
                                                 double coarseness);
// Throws Error{bad_input} naming `source`.
[[nodiscard]] Eigen::MatrixXd decode_frame_basis(std::span<const std::byte> bytes, int frames, int components,
                                                 const std::string& source);

// Eigenvectors of a symmetric positive semi-definite matrix by falling eigenvalue, with the roots of these.
struct PrincipalComponents {
  Eigen::MatrixXd functions;
  Eigen::VectorXd sizes;
};
[[nodiscard]] PrincipalComponents principal_components(const Eigen::MatrixXd& gram);

}  // namespace kinespace
