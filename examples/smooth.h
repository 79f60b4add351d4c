// Smooth functions of time that the sample motions are put together from. All are twice continuously differentiable.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace kinespace::samples {

inline constexpr double pi = std::numbers::pi;
inline constexpr double degree = pi / 180;
inline constexpr double gravity = 981;  // cm/s^2

// 0 up to x = 0, 1 from x = 1; first and second derivatives are zero at both ends.
[[nodiscard]] inline double smootherstep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

// From 0 at u = 0 to 1 at u = 1: the velocity rises during the first `in` of the way's time, stays, and falls during
// the last `out`; in + out <= 1. Shorter ramps leave and arrive later and faster than smootherstep does.
[[nodiscard]] inline double travel(double u, double in, double out) {
  u = std::clamp(u, 0.0, 1.0);
  const double speed = 1 / (1 - (in + out) / 2);
  const auto ramp = [](double x) { return x * x * x * (1 - x / 2); };  // integral of 3x^2 - 2x^3
  if (u < in) return speed * in * ramp(u / in);
  if (u > 1 - out) return 1 - speed * out * ramp((1 - u) / out);
  return speed * (u - in / 2);
}

// A bump of height 1 on (0, 1), flat to third order at the ends, highest at rise / (rise + fall); powers >= 3.
[[nodiscard]] inline double bump(double u, double rise, double fall) {
  if (u <= 0 || u >= 1) return 0;
  const double peak = rise / (rise + fall);
  return std::pow(u / peak, rise) * std::pow((1 - u) / (1 - peak), fall);
}

// Values at times, joined by smootherstep, so still at each key; constant before the first and after the last.
class Keys {
 public:
  struct Key {
    double time;
    double value;
  };
  explicit Keys(std::vector<Key> keys) : keys_(std::move(keys)) {}

  [[nodiscard]] double operator()(double t) const {
    if (t <= keys_.front().time) return keys_.front().value;
    for (std::size_t i = 1; i < keys_.size(); ++i) {
      const Key& a = keys_[i - 1];
      const Key& b = keys_[i];
      if (t < b.time) return a.value + (b.value - a.value) * smootherstep((t - a.time) / (b.time - a.time));
    }
    return keys_.back().value;
  }

 private:
  std::vector<Key> keys_;
};

// The polynomial of degree five with given position, velocity and acceleration at both ends of [start, end].
class Quintic {
 public:
  struct State {
    double position;
    double velocity;
    double acceleration;
  };
  Quintic(double start, const State& a, double end, const State& b) : start_(start) {
    const double d = end - start;
    const double p = b.position - a.position - d * (a.velocity + d * a.acceleration / 2);
    const double v = b.velocity - a.velocity - d * a.acceleration;
    const double c = b.acceleration - a.acceleration;
    coefficients_ = {a.position,
                     a.velocity,
                     a.acceleration / 2,
                     (10 * p - 4 * v * d + c * d * d / 2) / (d * d * d),
                     (-15 * p + 7 * v * d - c * d * d) / (d * d * d * d),
                     (6 * p - 3 * v * d + c * d * d / 2) / (d * d * d * d * d)};
  }
  [[nodiscard]] double operator()(double t) const {
    double sum = 0;
    for (std::size_t i = coefficients_.size(); i-- > 0;) sum = sum * (t - start_) + coefficients_[i];
    return sum;
  }

 private:
  double start_;
  std::array<double, 6> coefficients_{};
};

// Splitmix64 (Steele, Lea, Flood 2014): the same numbers with every standard library, unlike its distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15U);
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31U);
  }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(next() >> 11U) * 0x1.0p-53;
  }

 private:
  std::uint64_t state_;
};

// Slow wandering of at most `amplitude` about zero: three sines between 0.15 and 0.8 Hz, by chance.
class Wobble {
 public:
  Wobble(Random& random, double amplitude) : amplitude_(amplitude / 3) {
    for (std::size_t i = 0; i < rates_.size(); ++i) {
      rates_[i] = 2 * pi * random.between(0.15 + 0.2 * static_cast<double>(i), 0.4 + 0.2 * static_cast<double>(i));
      phases_[i] = random.between(0, 2 * pi);
    }
  }
  [[nodiscard]] double operator()(double t) const {
    double sum = 0;
    for (std::size_t i = 0; i < rates_.size(); ++i) sum += std::sin(rates_[i] * t + phases_[i]);
    return amplitude_ * sum;
  }

 private:
  double amplitude_;
  std::array<double, 3> rates_{};
  std::array<double, 3> phases_{};
};

}  // namespace kinespace::samples
