#include "kinespace/synthesis/detail/connection_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

namespace kinespace::connections {
namespace {

constexpr double on_border = 1e-9;

// A border of a piece at one scale, and how it moves with u.
struct Border {
  double at = 0, by_u = 0;
};

// Between two scales without a corner in between, one of the three stretches of shifts that v = 0 and v = 1 - u part.
struct RangePiece {
  Interval log_u;
  int stretch = 0;
  bool above_one = false;   // u
  bool above_even = false;  // the clock of motion 2 is what the smallest overlap is held to
  double by_second = 0, by_first = 0;

  // u times the smallest overlap.
  [[nodiscard]] Border least(double u) const {
    return above_even ? Border{by_second * u, by_second} : Border{by_first, 0};
  }
  [[nodiscard]] Border inner(double u, bool low) const { return low == above_one ? Border{1 - u, -1} : Border{0, 0}; }
  [[nodiscard]] Border lowest(double u) const {
    if (stretch > 0) return inner(u, stretch == 1);
    const Border m = least(u);
    return {m.at - u, m.by_u - 1};
  }
  [[nodiscard]] Border highest(double u) const {
    if (stretch < 2) return inner(u, stretch == 0);
    const Border m = least(u);
    return {1 - m.at, -m.by_u};
  }
  [[nodiscard]] OverlapEnds ends() const {
    const bool both = stretch == 1 && above_one;
    return {.begin_moves = stretch == 0 || both, .end_moves = stretch == 2 || both};
  }
  [[nodiscard]] bool contains(double at_log_u, double v) const {
    const double u = std::exp2(at_log_u);
    return at_log_u >= log_u.begin - on_border && at_log_u <= log_u.end + on_border && v >= lowest(u).at - on_border &&
           v <= highest(u).at + on_border;
  }
};

std::vector<RangePiece> pieces_of(const LegalRange& range) {
  const Interval scales = range.scales();
  std::array<double, 4> breaks{scales.begin, std::clamp(0.0, scales.begin, scales.end),
                               std::clamp(range.even(), scales.begin, scales.end), scales.end};
  std::ranges::sort(breaks);
  std::vector<RangePiece> out;
  for (std::size_t i = 0; i + 1 < breaks.size(); ++i) {
    const bool last = i + 2 == breaks.size() && out.empty();
    if (breaks[i + 1] - breaks[i] <= on_border && !last) continue;
    const double middle = (breaks[i] + breaks[i + 1]) / 2;
    for (int stretch = 0; stretch < 3; ++stretch) {
      out.push_back({.log_u = {breaks[i], breaks[i + 1]},
                     .stretch = stretch,
                     .above_one = middle >= 0,
                     .above_even = middle >= range.even(),
                     .by_second = range.shortest_s / range.second->length_s,
                     .by_first = range.shortest_s / range.first->length_s});
    }
  }
  return out;
}

// The minimum of a piece from a place in it.
RefinedConnection minimise_piece(const PairCost& cost, const RangePiece& piece, double log_u, double v,
                                 BoxMinimiser minimiser) {
  const auto shift_at = [&](const BoxPoint& x) {
    const double u = std::exp2(x[0]);
    const double low = piece.lowest(u).at, high = std::max(low, piece.highest(u).at);
    return low + x[1] * (high - low);
  };
  const BoxFunction function = [&](const BoxPoint& x, BoxPoint& gradient) {
    const double u = std::exp2(x[0]);
    const Border low = piece.lowest(u), high = piece.highest(u);
    const double width = std::max(0.0, high.at - low.at);
    Eigen::Vector2d slopes;
    const double value = cost(u, low.at + x[1] * width, piece.ends(), slopes);
    const double v_by_u = low.by_u + x[1] * (high.by_u - low.by_u);
    gradient[0] = std::numbers::ln2 * u * (slopes[0] + slopes[1] * v_by_u);
    gradient[1] = slopes[1] * width;
    return value;
  };
  const double u = std::exp2(log_u), low = piece.lowest(u).at, width = piece.highest(u).at - low;
  BoxPoint start(2), lower(2), upper(2);
  start << log_u, (width > on_border ? (v - low) / width : 0.5);
  lower << piece.log_u.begin, 0;
  upper << piece.log_u.end, 1;
  // The table's cells are near: a longer first step would leap to other minima.
  const BoxMinimum found = minimiser(function, start, lower, upper, {.first_step = 0.03});
  return {.cost = found.value, .log_u = found.at[0], .v = shift_at(found.at), .evaluations = found.evaluations};
}

}  // namespace

double LegalRange::even() const {
  return std::log2(second->length_s / first->length_s);
}

// The legal speeds, scales of the table, and those at which the smallest overlap fits into both motions.
Interval LegalRange::scales() const {
  return {std::max({even() - std::log2(fastest), -scale_octaves, std::log2(shortest_s / first->length_s)}),
          std::min({even() + std::log2(fastest), scale_octaves, std::log2(second->length_s / shortest_s)})};
}

Interval LegalRange::shifts(double log_u) const {
  const double u = std::exp2(log_u);
  return shifts_for(u, least_overlap_of(*first, *second, u, shortest_s));
}

RefinedConnection refine(const PairCost& cost, const LegalRange& range, double log_u, double v,
                         BoxMinimiser minimiser) {
  constexpr int most_pieces = 8;      // tried from one start
  constexpr double worth_it = 1e-12;  // of E
  const Interval scales = range.scales();
  RefinedConnection best{.log_u = std::clamp(log_u, scales.begin, scales.end)};
  const Interval shifts = range.shifts(best.log_u);
  best.v = std::clamp(v, shifts.begin, std::max(shifts.begin, shifts.end));
  const std::vector<RangePiece> pieces = pieces_of(range);
  std::vector<bool> tried(pieces.size());
  for (int run = 0; run < most_pieces; ++run) {
    std::size_t next = 0;
    while (next < pieces.size() && (tried[next] || !pieces[next].contains(best.log_u, best.v))) ++next;
    if (next == pieces.size()) break;
    tried[next] = true;
    RefinedConnection found = minimise_piece(cost, pieces[next], best.log_u, best.v, minimiser);
    found.evaluations += best.evaluations;
    if (found.cost < best.cost - worth_it * std::abs(best.cost) || run == 0) {
      best = found;
      tried.assign(pieces.size(), false);  // from a new place they may lead on
      tried[next] = true;
    } else {
      best.evaluations = found.evaluations;
    }
  }
  return best;
}

}  // namespace kinespace::connections
