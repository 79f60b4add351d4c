// A time warp: the monotone curve from a sequence's time in the motion space to its own time, both over [0, 1].
//
//   h(s) = s + sum_k a_k sin(k pi s) / (k pi),      h'(s) = 1 + sum_k a_k cos(k pi s),      k = 1 .. 5
//
// Smooth to every order, so that a warped curve needs no more functions than it has to (the bends of a piecewise warp
// would show in the higher ones), and it fixes both ends. The a_k are kept in steps of 1/64: a warp is five bytes. Its
// slope stays within [1/2, 2] (yoo2019, section 5.2, has no limits; sakoe 1978 has these).
#pragma once

#include <array>
#include <cstdint>

namespace kinespace {

class Warp {
 public:
  static constexpr int terms = 5;
  static constexpr int steps = 64;  // of an a_k, per unit
  using Coefficients = std::array<std::int8_t, terms>;

  // The identity.
  Warp() = default;
  // Throws Error{bad_input} when the slope leaves [1/2, 2].
  explicit Warp(const Coefficients& coefficients);
  [[nodiscard]] static bool legal(const Coefficients& coefficients);
  // The warp through the given own times at space times k / (terms + 1), as far towards it from the identity as is
  // legal.
  [[nodiscard]] static Warp through(const std::array<double, terms>& own_times);

  [[nodiscard]] const Coefficients& coefficients() const { return coefficients_; }
  [[nodiscard]] bool is_identity() const { return coefficients_ == Coefficients{}; }

  // Own time at space time s in [0, 1].
  [[nodiscard]] double own_time(double s) const;
  // d own_time / ds.
  [[nodiscard]] double slope(double s) const;
  // Space time at own time u in [0, 1]: own_time(space_time(u)) = u to 1e-12.
  [[nodiscard]] double space_time(double u) const;

 private:
  Coefficients coefficients_{};
};

}  // namespace kinespace
