#include "kinespace/codecs/rma/detail/spline_fit.h"

#include <algorithm>
#include <cmath>

namespace kinespace {
namespace {

double slope(std::span<const int> knots, std::span<const double> values, std::size_t i) {
  const std::size_t before = i > 0 ? i - 1 : i;
  const std::size_t after = i + 1 < knots.size() ? i + 1 : i;
  return (values[after] - values[before]) / (knots[after] - knots[before]);
}

// The piece between knots i and i + 1, both ends included, to out[0 ..].
void evaluate_piece(std::span<const int> knots, std::span<const double> values, std::size_t i, double* out) {
  const int length = knots[i + 1] - knots[i];
  const double inverse = 1.0 / length;
  const double a = values[i];
  const double b = values[i + 1];
  const double from = slope(knots, values, i) * length;
  const double to = slope(knots, values, i + 1) * length;
  const double square = 3 * (b - a) - 2 * from - to;
  const double cube = 2 * (a - b) + from + to;
  for (int f = 0; f <= length; ++f) {
    const double u = f * inverse;
    out[f] = a + u * (from + u * (square + u * cube));
  }
}

// A curve while control points are added to it.
class Fit {
 public:
  Fit(std::span<const double> curve, std::span<const int> start)
      : curve_(curve), knots_(start.begin(), start.end()), shown_(curve.size()) {
    for (const int k : knots_) values_.push_back(curve_[static_cast<std::size_t>(k)]);
    for (std::size_t i = 0; i + 1 < knots_.size(); ++i) {
      evaluate_piece(knots_, values_, i, shown_.data() + knots_[i]);
      worst_.push_back(worst_of(i));
    }
  }

  // Adds the worst frame; false when none is off by more than the tolerance.
  bool refine(double tolerance) {
    const auto piece = std::ranges::max_element(worst_, {}, &Worst::error);
    if (piece == worst_.end() || !(piece->error > tolerance)) return false;
    const auto at = static_cast<std::size_t>(piece - worst_.begin());
    const int frame = piece->frame;
    const auto place = static_cast<std::ptrdiff_t>(at) + 1;
    knots_.insert(knots_.begin() + place, frame);
    values_.insert(values_.begin() + place, curve_[static_cast<std::size_t>(frame)]);
    worst_.insert(worst_.begin() + place, Worst{});
    // Tangents changed at the new knot and its neighbours: four pieces.
    const std::size_t first = at > 0 ? at - 1 : 0;
    for (std::size_t i = first; i < std::min(at + 3, worst_.size()); ++i) {
      evaluate_piece(knots_, values_, i, shown_.data() + knots_[i]);
      worst_[i] = worst_of(i);
    }
    return true;
  }
  [[nodiscard]] std::vector<int> take() && { return std::move(knots_); }

 private:
  struct Worst {
    double error = 0;
    int frame = 0;
  };
  [[nodiscard]] Worst worst_of(std::size_t i) const {
    Worst out;
    for (int f = knots_[i] + 1; f < knots_[i + 1]; ++f) {
      const double error = std::abs(curve_[static_cast<std::size_t>(f)] - shown_[static_cast<std::size_t>(f)]);
      if (error > out.error) out = {error, f};
    }
    return out;
  }

  std::span<const double> curve_;
  std::vector<int> knots_;
  std::vector<double> values_;
  std::vector<double> shown_;
  std::vector<Worst> worst_;  // by piece
};

}  // namespace

std::vector<int> regular_knots(int frames, int span) {
  if (frames <= 1) return {0};
  const int pieces = (frames - 2) / std::max(span, 1) + 1;
  std::vector<int> out;
  out.reserve(static_cast<std::size_t>(pieces) + 1);
  for (int i = 0; i <= pieces; ++i) {
    out.push_back(static_cast<int>(static_cast<long long>(i) * (frames - 1) / pieces));
  }
  return out;
}

void evaluate_spline(std::span<const int> knots, std::span<const double> values, std::span<double> out) {
  if (knots.size() == 1) {
    out[0] = values[0];
    return;
  }
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    evaluate_piece(knots, values, i, out.data() + (knots[i] - knots[0]));
  }
}

std::vector<int> fit_knots(std::span<const double> curve, std::span<const int> start, double tolerance) {
  Fit fit(curve, start);
  while (fit.refine(tolerance)) {
  }
  return std::move(fit).take();
}

}  // namespace kinespace
