#include "kinespace/codecs/qbc/quadratic_bezier.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

// The data with the numbers of a frame together.
class Points {
 public:
  Points(std::span<const double> values, int dimensions)
      : dimensions_(static_cast<std::size_t>(dimensions)),
        frames_(values.size() / dimensions_),
        values_(values.size()) {
    for (std::size_t d = 0; d < dimensions_; ++d) {
      for (std::size_t f = 0; f < frames_; ++f) values_[f * dimensions_ + d] = values[d * frames_ + f];
    }
  }
  [[nodiscard]] std::size_t dimensions() const { return dimensions_; }
  [[nodiscard]] int frames() const { return static_cast<int>(frames_); }
  [[nodiscard]] const double* at(int frame) const {
    return values_.data() + static_cast<std::size_t>(frame) * dimensions_;
  }

 private:
  std::size_t dimensions_;
  std::size_t frames_;
  std::vector<double> values_;
};

// The least squares middle of the segment [first, last], and its worst frame.
class SegmentFit {
 public:
  explicit SegmentFit(const Points& points) : points_(points), middle_(points.dimensions()) {}

  // The squared distance of the worst frame, which is left in `worst`.
  double fit(int first, int last, int& worst) {
    fit_middle(first, last);
    const int length = last - first;
    worst = first;
    double largest = 0;
    if (length <= 2) return largest;
    const double* p0 = points_.at(first);
    const double* p2 = points_.at(last);
    for (int i = 1; i < length; ++i) {
      const double t = static_cast<double>(i) / length;
      const double a = (1 - t) * (1 - t), w = 2 * t * (1 - t), b = t * t;
      const double* p = points_.at(first + i);
      double distance = 0;
      for (std::size_t d = 0; d < middle_.size(); ++d) {
        const double off = p[d] - a * p0[d] - w * middle_[d] - b * p2[d];
        distance += off * off;
      }
      if (distance > largest) {
        largest = distance;
        worst = first + i;
      }
    }
    return largest;
  }
  [[nodiscard]] const std::vector<double>& middle() const { return middle_; }

 private:
  void fit_middle(int first, int last) {
    const int length = last - first;
    const double* p0 = points_.at(first);
    const double* p2 = points_.at(last);
    if (length == 1) {
      for (std::size_t d = 0; d < middle_.size(); ++d) middle_[d] = (p0[d] + p2[d]) / 2;
      return;
    }
    std::ranges::fill(middle_, 0.0);
    double weight = 0;
    for (int i = 1; i < length; ++i) {
      const double t = static_cast<double>(i) / length;
      const double a = (1 - t) * (1 - t), w = 2 * t * (1 - t), b = t * t;
      const double* p = points_.at(first + i);
      for (std::size_t d = 0; d < middle_.size(); ++d) middle_[d] += w * (p[d] - a * p0[d] - b * p2[d]);
      weight += w * w;
    }
    for (double& m : middle_) m /= weight;
  }

  const Points& points_;
  std::vector<double> middle_;
};

}  // namespace

void BezierFitOptions::validate() const {
  if (!(max_squared_distance > 0 && std::isfinite(max_squared_distance))) {
    throw Error(ErrorKind::usage,
                {.found = fmt::format("BezierFitOptions::max_squared_distance = {}", max_squared_distance),
                 .expected = "more than 0"});
  }
  if (interval < 1) {
    throw Error(ErrorKind::usage,
                {.found = fmt::format("BezierFitOptions::interval = {}", interval), .expected = "at least 1 frame"});
  }
}

BezierCurve fit_quadratic_bezier(std::span<const double> values, int dimensions, const BezierFitOptions& options) {
  options.validate();
  const Points points(values, dimensions);
  const int last = points.frames() - 1;
  BezierCurve out{.dimensions = dimensions, .breaks = {0}};
  const auto add_end = [&](int frame) {
    out.ends.insert(out.ends.end(), points.at(frame), points.at(frame) + dimensions);
  };
  add_end(0);
  SegmentFit segment(points);
  std::vector<int> waiting;  // ends of segments to come, the nearest last
  for (int first = 0; first < last;) {
    if (waiting.empty()) waiting.push_back(std::min(last - first, options.interval) + first);
    const int end = waiting.back();
    int worst = first;
    out.fitted += end - first;
    if (segment.fit(first, end, worst) > options.max_squared_distance) {
      waiting.push_back(worst);
      continue;
    }
    waiting.pop_back();
    out.breaks.push_back(end);
    add_end(end);
    out.middles.insert(out.middles.end(), segment.middle().begin(), segment.middle().end());
    first = end;
  }
  return out;
}

void evaluate(const BezierCurve& curve, int first, int count, std::span<double> out) {
  const auto n = static_cast<std::size_t>(count);
  const auto dimensions = static_cast<std::size_t>(curve.dimensions);
  if (curve.segments() == 0) {
    for (std::size_t d = 0; d < dimensions; ++d) out[d * n] = curve.ends[d];
    return;
  }
  const auto next = std::ranges::upper_bound(curve.breaks, first);
  auto s = static_cast<std::size_t>(std::max<std::ptrdiff_t>(next - curve.breaks.begin() - 1, 0));
  s = std::min(s, static_cast<std::size_t>(curve.segments()) - 1);
  for (std::size_t i = 0; i < n; ++i) {
    const int frame = first + static_cast<int>(i);
    while (frame > curve.breaks[s + 1]) ++s;
    const double t = static_cast<double>(frame - curve.breaks[s]) / (curve.breaks[s + 1] - curve.breaks[s]);
    const double a = (1 - t) * (1 - t), w = 2 * t * (1 - t), b = t * t;
    const double* p0 = curve.ends.data() + s * dimensions;
    const double* p1 = curve.middles.data() + s * dimensions;
    for (std::size_t d = 0; d < dimensions; ++d) out[d * n + i] = (a * p0[d] + w * p1[d]) + b * p0[dimensions + d];
  }
}

double max_squared_distance(const BezierCurve& curve, std::span<const double> values) {
  const auto n = static_cast<std::size_t>(curve.frames());
  std::vector<double> fitted(values.size());
  evaluate(curve, 0, curve.frames(), fitted);
  double out = 0;
  for (std::size_t f = 0; f < n; ++f) {
    double distance = 0;
    for (std::size_t d = 0; d < static_cast<std::size_t>(curve.dimensions); ++d) {
      const double off = values[d * n + f] - fitted[d * n + f];
      distance += off * off;
    }
    out = std::max(out, distance);
  }
  return out;
}

}  // namespace kinespace
