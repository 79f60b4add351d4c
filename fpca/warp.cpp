#include "kinespace/fpca/warp.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

using std::numbers::pi;

constexpr int slope_checks = 64;

double slope_of(const Warp::Coefficients& coefficients, double s) {
  double sum = 1;
  for (std::size_t k = 0; k < coefficients.size(); ++k) {
    sum += coefficients[k] * std::cos(static_cast<double>(k + 1) * pi * s) / Warp::steps;
  }
  return sum;
}

// cos(k pi i / slope_checks), once: legality is asked for in the innermost loop of the alignment.
using CosineTable = std::array<std::array<float, Warp::terms>, slope_checks + 1>;
CosineTable cosine_table() {
  CosineTable out{};
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (std::size_t k = 0; k < Warp::terms; ++k) {
      out[i][k] = static_cast<float>(std::cos(static_cast<double>((k + 1) * i) * pi / slope_checks) / Warp::steps);
    }
  }
  return out;
}

}  // namespace

Warp::Warp(const Coefficients& coefficients) : coefficients_(coefficients) {
  if (!legal(coefficients)) {
    throw Error(ErrorKind::bad_input,
                {.found = "a time warp with a slope outside [1/2, 2]", .expected = "a legal warp"});
  }
}

bool Warp::legal(const Coefficients& coefficients) {
  static const CosineTable table = cosine_table();
  return std::ranges::all_of(table, [&](const auto& cosines) {
    float slope = 1;
    for (std::size_t k = 0; k < cosines.size(); ++k) slope += static_cast<float>(coefficients[k]) * cosines[k];
    return slope >= 0.5F && slope <= 2.0F;
  });
}

Warp Warp::through(const std::array<double, terms>& own_times) {
  Eigen::Matrix<double, terms, terms> system;
  Eigen::Vector<double, terms> offset;
  for (int i = 0; i < terms; ++i) {
    const double s = (i + 1.0) / (terms + 1);
    for (int k = 0; k < terms; ++k) system(i, k) = std::sin((k + 1) * pi * s) / ((k + 1) * pi);
    offset(i) = own_times[static_cast<std::size_t>(i)] - s;
  }
  const Eigen::Vector<double, terms> a = system.partialPivLu().solve(offset);
  for (int tenths = 10; tenths > 0; --tenths) {
    const double part = tenths / 10.0;
    Coefficients coefficients{};
    for (int k = 0; k < terms; ++k) {
      coefficients[static_cast<std::size_t>(k)] =
          static_cast<std::int8_t>(std::clamp(std::lround(part * a(k) * steps), -127L, 127L));
    }
    if (legal(coefficients)) return Warp(coefficients);
  }
  return {};
}

double Warp::own_time(double s) const {
  double sum = s;
  for (std::size_t k = 0; k < coefficients_.size(); ++k) {
    if (coefficients_[k] == 0) continue;
    const double w = static_cast<double>(k + 1) * pi;
    sum += coefficients_[k] * std::sin(w * s) / (w * steps);
  }
  return sum;
}

double Warp::slope(double s) const {
  return slope_of(coefficients_, s);
}

double Warp::space_time(double u) const {
  if (u <= 0) return 0;
  if (u >= 1) return 1;
  if (is_identity()) return u;
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
