// Shared by the files of connection.h: the legal range of a connection.
#pragma once

#include <algorithm>
#include <limits>

#include "kinespace/synthesis/connection.h"

namespace kinespace::connections {

constexpr int bound_cells = 40;  // a stretch is bounded from below over so many cells of its time
constexpr double least_speed = 0.5, largest_speed = 2;
constexpr double scale_octaves = 3;  // u from 1/8 to 8
constexpr double infinite = std::numeric_limits<double>::infinity();

struct Interval {
  double begin = 0, end = 0;
  [[nodiscard]] double length() const { return end - begin; }
};

// S: where s and u s + v both lie in [0, 1].
inline Interval overlap_of(double u, double v) {
  return {std::max(0.0, -v / u), std::min(1.0, (1 - v) / u)};
}

// The shifts for which the overlap is at least `least` long (in s); empty (begin > end) when there are none.
inline Interval shifts_for(double u, double least) {
  return {-u * (1 - least), 1 - u * least};
}

inline double speed_of(const ConnectionMotion& first, const ConnectionMotion& second, double u) {
  return u * first.length_s / second.length_s;
}

// The smallest |S| that lasts `shortest_s` by either clock.
inline double least_overlap_of(const ConnectionMotion& first, const ConnectionMotion& second, double u,
                               double shortest_s) {
  return std::max(shortest_s / second.length_s, shortest_s / (u * first.length_s));
}

inline bool legal_speed(double speed) {
  constexpr double rounding = 1e-9;
  return speed >= least_speed - rounding && speed <= largest_speed + rounding;
}

}  // namespace kinespace::connections
