// The functions of time that the motion-space codec codes a window of motion in.
//
// They are the eigenfunctions of the integrated squared second derivative on an interval with free ends: the constant,
// the line, and the free-free vibrations of a beam,
//
//   phi_k(u) = cos(b_k u) / cos(b_k / 2) + cosh(b_k u) / cosh(b_k / 2)     k even
//   phi_k(u) = sin(b_k u) / sin(b_k / 2) + sinh(b_k u) / sinh(b_k / 2)     k odd       u in [-1/2, 1/2]
//
// with cos b cosh b = 1, b_k near (k - 1/2) pi. They are the functional principal components of what motion looks like
// when nothing is known but that it is smooth (an integrated Brownian path; the Demmler-Reinsch system of smoothing
// splines). Fitted to recordings they are as good as that recording's own FPCA functions over windows of seconds (to 1
// or 2 % of the bytes), and nothing about them has to be sent. Against a cosine transform they take a twentieth to a
// tenth off the bytes, as no false kink stands at the ends of a window.
//
// Function k of a window of T seconds oscillates at about k / (2 T) Hz. Sampled at the middles of n equal steps and
// divided by sqrt(n) they are near orthonormal (singular values of the first half: 0.93 to 1.005).
//
// Computed by sums, products and square roots in a fixed order, without the machine's libm: the same bits everywhere.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace kinespace {

class NaturalFunctions {
 public:
  // Tables the first `count` functions on `points` points; 1 <= count <= points.
  NaturalFunctions(int points, int count);

  [[nodiscard]] int points() const { return points_; }
  [[nodiscard]] int count() const { return count_; }
  // phi_k / sqrt(points) at all points.
  [[nodiscard]] std::vector<double> function(int k) const;

  // out[t] = sum over k < coefficients.size() of coefficients[k] phi_k(t) / sqrt(points). At most count() coefficients.
  // Each function is even or odd, so half of the points are summed and mirrored.
  void synthesise(std::span<const double> coefficients, std::span<double> out) const;

  // The same for many curves at once: coefficients [curve][stride], of which the first `used` count; out
  // [curve][points].
  void synthesise(const double* coefficients, std::ptrdiff_t stride, int used, int curves, double* out,
                  std::vector<double>& scratch) const;

 private:
  int points_;
  int count_;
  int half_;                   // (points + 1) / 2
  std::vector<double> table_;  // [k][t < half]
};

// cos and sin of any angle (|x| < 1e6) to 1e-15 by polynomials, the same bits on every machine.
void fixed_sin_cos(double x, double& sine, double& cosine) noexcept;

}  // namespace kinespace
