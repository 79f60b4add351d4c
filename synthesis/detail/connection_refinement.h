// From a cell of the table to the nearest minimum of E(u, v) (connection.h).
#pragma once

#include "kinespace/numerics/bounded_minimum.h"
#include "kinespace/synthesis/detail/connection_cost.h"

namespace kinespace::connections {

// The (u, v) that are legal for a pair: an interval of scales, by their logarithm to base 2, and at each an interval of
// shifts.
struct LegalRange {
  const ConnectionMotion* first;
  const ConnectionMotion* second;
  double shortest_s;
  double fastest = largest_speed;  // of one motion against the other, 1 to 2

  // log u at which both motions play at the same speed.
  [[nodiscard]] double even() const;
  // Empty (begin > end) when there are none.
  [[nodiscard]] Interval scales() const;
  [[nodiscard]] Interval shifts(double log_u) const;
};

struct RefinedConnection {
  double cost = infinite;  // E
  double log_u = 0, v = 0;
  int evaluations = 0;
};

// The local minimum that the minimiser reaches from (log_u, v). E has edges along v = 0 and u + v = 1, and the border of
// the legal range has corners; between them it is smooth, and each piece between them is a box in log u and the share
// of the way from the lowest to the highest shift of the piece. A minimum of a piece that lies on its border is tried
// from the piece beyond, until none is lower. A start outside the range is moved into it.
[[nodiscard]] RefinedConnection refine(const PairCost& cost, const LegalRange& range, double log_u, double v,
                                       BoxMinimiser minimiser);

}  // namespace kinespace::connections
