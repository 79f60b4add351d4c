// A time warp: the monotone curve from a sequence's time in the motion space to its own time.
//
// Both run over [0, 1]. The curve goes through (0, 0), (k / 4, h_k) and (1, 1) as a monotone cubic (Fritsch and Carlson
// 1980: C1, no overshoot); the three h_k are kept in steps of 1/256, so a warp is three bytes. Between knots the mean slope
// stays within [1/2, 2].
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace kinespace {

class Warp {
 public:
  static constexpr int knot_count = 3;
  static constexpr int steps = 256;
  using Knots = std::array<std::uint8_t, knot_count>;

  // The identity.
  Warp();
  // Throws Error{bad_input} when a slope between knots leaves [1/2, 2].
  explicit Warp(const Knots& knots);
  [[nodiscard]] static bool legal(const Knots& knots);
  // The legal warp whose knots lie nearest to the given values at 1/4, 1/2, 3/4.
  [[nodiscard]] static Warp nearest(const std::array<double, knot_count>& values);

  [[nodiscard]] const Knots& knots() const { return knots_; }
  [[nodiscard]] bool is_identity() const;

  // Own time at space time s in [0, 1].
  [[nodiscard]] double own_time(double s) const;
  // d own_time / ds, > 0.
  [[nodiscard]] double slope(double s) const;
  // Space time at own time u in [0, 1]: own_time(space_time(u)) = u to 1e-12.
  [[nodiscard]] double space_time(double u) const;

 private:
  Knots knots_;
  std::array<double, knot_count + 2> value_{};    // at 0, 1/4, 1/2, 3/4, 1
  std::array<double, knot_count + 2> tangent_{};  // d/ds
};

}  // namespace kinespace
