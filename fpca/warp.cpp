#include "fpca/warp.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace kinespace {
namespace {

constexpr int pieces = Warp::knot_count + 1;
constexpr double width = 1.0 / pieces;
constexpr int shallowest = Warp::steps / pieces / 2;  // steps between knots at slope 1/2
constexpr int steepest = Warp::steps / pieces * 2;    // and at slope 2
constexpr Warp::Knots identity_knots{64, 128, 192};

struct Place {
  std::size_t piece;
  double t;  // within the piece, [0, 1]
};

Place place_of(double s) {
  const double scaled = std::clamp(s, 0.0, 1.0) * pieces;
  const auto piece = std::min(static_cast<std::size_t>(scaled), static_cast<std::size_t>(pieces - 1));
  return {piece, scaled - static_cast<double>(piece)};
}

}  // namespace

Warp::Warp() : Warp(identity_knots) {}

Warp::Warp(const Knots& knots) : knots_(knots) {
  if (!legal(knots)) {
    throw Error(ErrorKind::bad_input, {.found = "a time warp with a slope outside [1/2, 2]", .expected = "a legal warp"});
  }
  value_.front() = 0;
  value_.back() = 1;
  for (std::size_t k = 0; k < knots.size(); ++k) value_[k + 1] = static_cast<double>(knots[k]) / steps;
  std::array<double, pieces> secant{};
  for (std::size_t k = 0; k < secant.size(); ++k) secant[k] = (value_[k + 1] - value_[k]) / width;
  // Harmonic means keep the cubic monotone for any secants of one sign (Fritsch and Butland 1984).
  tangent_.front() = secant.front();
  tangent_.back() = secant.back();
  for (std::size_t k = 1; k < secant.size(); ++k) {
    tangent_[k] = 2 * secant[k - 1] * secant[k] / (secant[k - 1] + secant[k]);
  }
}

bool Warp::legal(const Knots& knots) {
  int before = 0;
  for (std::size_t k = 0; k <= knots.size(); ++k) {
    const int value = k < knots.size() ? knots[k] : steps;
    if (value - before < shallowest || value - before > steepest) return false;
    before = value;
  }
  return true;
}

Warp Warp::nearest(const std::array<double, knot_count>& values) {
  Knots knots{};
  int before = 0;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const int left = pieces - 1 - static_cast<int>(k);  // pieces still to come
    const int low = std::max(before + shallowest, steps - left * steepest);
    const int high = std::min(before + steepest, steps - left * shallowest);
    const int wanted = static_cast<int>(std::lround(std::clamp(values[k], 0.0, 1.0) * steps));
    before = std::clamp(wanted, low, high);
    knots[k] = static_cast<std::uint8_t>(before);
  }
  return Warp(knots);
}

bool Warp::is_identity() const { return knots_ == identity_knots; }

double Warp::own_time(double s) const {
  const auto [k, t] = place_of(s);
  const double t2 = t * t;
  const double t3 = t2 * t;
  return value_[k] * (2 * t3 - 3 * t2 + 1) + value_[k + 1] * (3 * t2 - 2 * t3) +
         width * (tangent_[k] * (t3 - 2 * t2 + t) + tangent_[k + 1] * (t3 - t2));
}

double Warp::slope(double s) const {
  const auto [k, t] = place_of(s);
  const double t2 = t * t;
  return (value_[k + 1] - value_[k]) / width * (6 * t - 6 * t2) + tangent_[k] * (3 * t2 - 4 * t + 1) +
         tangent_[k + 1] * (3 * t2 - 2 * t);
}

double Warp::space_time(double u) const {
  if (u <= 0) return 0;
  if (u >= 1) return 1;
  double low = 0;
  double high = 1;
  double s = u;
  for (int i = 0; i < 60; ++i) {  // Newton, kept inside a shrinking bracket
    const double error = own_time(s) - u;
    if (std::abs(error) < 1e-14) break;
    (error > 0 ? high : low) = s;
    const double next = s - error / slope(s);
    s = next > low && next < high ? next : (low + high) / 2;
  }
  return s;
}

}  // namespace kinespace
