// The choice of numbers, and of all of it together.
#include "codecs/qbc/curve_choice.h"

#include <algorithm>
#include <cmath>

namespace kinespace {
namespace {

class NumberChoice {
 public:
  NumberChoice(const CurveTask& task, const std::vector<int>& breaks)
      : task_(task), shape_(shape_of(task)), n_(static_cast<std::size_t>(task.dimensions)), predictor_(shape_) {
    out_.breaks = breaks;
    for (std::size_t s = 0; s + 1 < breaks.size(); ++s) sums_.push_back(segment_sums(task, breaks[s], breaks[s + 1]));
    for (std::size_t b = 0; b < breaks.size(); ++b) add_to_system(b);
  }

  CurveNumbers choose() {
    choose_common();
    if (out_.breaks.size() < 2) return std::move(out_);
    std::size_t first = 0;
    for (int i = 0; i < shape_.interval_count(); ++i) {
      std::size_t last = first + 1;
      while (out_.breaks[last] != shape_.common_break(i + 1)) ++last;
      choose_interval(first, last, static_cast<std::size_t>(i));
      first = last;
    }
    return std::move(out_);
  }

 private:
  [[nodiscard]] int length(std::size_t s) const { return out_.breaks[s + 1] - out_.breaks[s]; }

  // Row b of the system in the ends, all middles at their best.
  void add_to_system(std::size_t b) {
    diagonal_.push_back(0);
    off_.push_back(0);
    right_.emplace_back();
    if (b == 0) {
      diagonal_[0] = 1;
      std::copy_n(task_.at(0), n_, right_[0].begin());
    }
    const auto add = [&](std::size_t s, bool as_first) {
      const BernsteinGram& g = bernstein_gram(length(s));
      const ReducedGram& r = reduced_gram(length(s));
      const double k = length(s) > 1 ? (as_first ? g.g01 : g.g12) / g.g11 : 0;
      diagonal_[b] += as_first ? r.g00 : r.g22;
      if (as_first) off_[b] = r.g02;
      for (std::size_t d = 0; d < n_; ++d) {
        right_[b][d] += (as_first ? sums_[s].r0[d] : sums_[s].r2[d]) - k * sums_[s].r1[d];
      }
    };
    if (b > 0) add(b - 1, false);
    if (b + 1 < out_.breaks.size()) add(b, true);
  }

  // What is left of the system for ends [first, last] when the later ones, down from last, are at their best.
  void eliminate(std::size_t first, std::size_t last) {
    weight_.assign(last + 1 - first, 0);
    rest_.assign(last + 1 - first, {});
    for (std::size_t b = last + 1; b-- > first;) {
      const std::size_t i = b - first;
      weight_[i] = diagonal_[b];
      rest_[i] = right_[b];
      if (b == last) continue;
      const double factor = off_[b] / weight_[i + 1];
      weight_[i] -= factor * off_[b];
      for (std::size_t d = 0; d < n_; ++d) rest_[i][d] -= factor * rest_[i + 1][d];
    }
  }

  // The number that costs least for a value that is to be near `target`.
  std::int64_t best_number(PointKind kind, std::size_t d, double expected, double step, double target, double weight) {
    const double exact = (target - expected) / step;
    const auto nearest = static_cast<std::int64_t>(std::llround(exact));
    const int size = context_.next(kind, d);
    std::int64_t best = nearest;
    double least = 1e300;
    const std::int64_t inwards = nearest > 0 ? nearest - 1 : nearest + 1;
    for (const std::int64_t number : {nearest, inwards, std::int64_t{0}}) {
      const double away = (static_cast<double>(number) - exact) * step;
      const double cost = weight * away * away + task_.rate_weight * number_bits(kind, size, number);
      if (cost < least) {
        least = cost;
        best = number;
      }
    }
    context_.see(kind, d, best);
    return best;
  }

  void choose_common() {
    eliminate(0, out_.breaks.size() - 1);
    std::vector<Point> free(out_.breaks.size());
    for (std::size_t b = 0; b < free.size(); ++b) {
      for (std::size_t d = 0; d < n_; ++d) {
        free[b][d] = (rest_[b][d] - (b > 0 ? off_[b - 1] * free[b - 1][d] : 0)) / weight_[b];
      }
    }
    const double step = end_step(shape_.step(), 16, 16);
    common_.assign(static_cast<std::size_t>(shape_.interval_count()) + 1, {});
    std::size_t b = 0;
    for (std::size_t i = 0; i < common_.size(); ++i) {
      while (out_.breaks[b] != shape_.common_break(static_cast<int>(i))) ++b;
      context_.begin_point();
      for (std::size_t d = 0; d < n_; ++d) {
        const double before = i > 0 ? common_[i - 1][d] : 0;
        const std::int64_t number = best_number(PointKind::common, d, before, step, free[b][d], weight_[b]);
        common_[i][d] = before + static_cast<double>(number) * step;
        out_.common.push_back(number);
      }
    }
  }

  // Segments [first, last), whose outer ends are fixed.
  void choose_interval(std::size_t first, std::size_t last, std::size_t interval) {
    const Point& goal = common_[interval + 1];
    if (last > first + 1) {
      for (std::size_t d = 0; d < n_; ++d) right_[last - 1][d] -= off_[last - 1] * goal[d];
      eliminate(first + 1, last - 1);
    }
    Point start = common_[interval];
    for (std::size_t s = first; s < last; ++s) {
      const bool at_goal = s + 1 == last;
      predictor_.begin(start.data());
      Point end = goal;
      context_.begin_point();
      if (!at_goal) {
        const double step = end_step(shape_.step(), length(s), length(s + 1));
        const int rest = out_.breaks[last] - out_.breaks[s];
        for (std::size_t d = 0; d < n_; ++d) {
          const std::size_t row = s - first;
          const double target = (rest_[row][d] - off_[s] * start[d]) / weight_[row];
          const double expected = predictor_.end(d, length(s), rest, goal[d]);
          const std::int64_t number = best_number(PointKind::end, d, expected, step, target, weight_[row]);
          end[d] = expected + static_cast<double>(number) * step;
          out_.points.push_back(number);
        }
      }
      const Point middle = choose_middle(s, start, end);
      predictor_.advance(length(s), middle.data(), end.data());
      start = end;
    }
  }

  Point choose_middle(std::size_t s, const Point& start, const Point& end) {
    Point out{};
    context_.begin_point();
    const double step = middle_step(shape_.step(), length(s));
    const BernsteinGram& g = bernstein_gram(length(s));
    for (std::size_t d = 0; d < n_; ++d) {
      out[d] = predictor_.middle(d, length(s), end[d]);
      if (length(s) < 2) continue;
      const double target = (sums_[s].r1[d] - g.g01 * start[d] - g.g12 * end[d]) / g.g11;
      const std::int64_t number = best_number(PointKind::middle, d, out[d], step, target, g.g11);
      out[d] += static_cast<double>(number) * step;
      out_.points.push_back(number);
    }
    return out;
  }

  const CurveTask& task_;
  CurveShape shape_;
  std::size_t n_;
  CurvePredictor predictor_;
  SizeContext context_;
  CurveNumbers out_;
  std::vector<SegmentSums> sums_;
  std::vector<double> diagonal_, off_, weight_;
  std::vector<Point> right_, rest_, common_;
};

}  // namespace

CurveNumbers choose_numbers(const CurveTask& task, const std::vector<int>& breaks) {
  return NumberChoice(task, breaks).choose();
}

void evaluate(const CodedCurve& curve, int dimensions, int first, int count, std::vector<double>& out) {
  const auto n = static_cast<std::size_t>(count);
  const auto dims = static_cast<std::size_t>(dimensions);
  out.resize(dims * n);
  if (curve.breaks.size() < 2) {
    for (std::size_t d = 0; d < dims; ++d) out[d * n] = curve.ends[d];
    return;
  }
  const auto next = std::ranges::lower_bound(curve.breaks, first);
  auto s = static_cast<std::size_t>(std::max<std::ptrdiff_t>(next - curve.breaks.begin() - 1, 0));
  for (int done = 0; done < count;) {
    while (first + done > curve.breaks[s + 1]) ++s;
    const int length = curve.breaks[s + 1] - curve.breaks[s];
    const int until = std::min(count, curve.breaks[s + 1] - first + 1);
    for (; done < until; ++done) {
      const double t = static_cast<double>(first + done - curve.breaks[s]) / length;
      const double a = (1 - t) * (1 - t), b = 2 * t * (1 - t), c = t * t;
      const double* p0 = curve.ends.data() + s * dims;
      const double* p1 = curve.middles.data() + s * dims;
      for (std::size_t d = 0; d < dims; ++d) {
        out[d * n + static_cast<std::size_t>(done)] = (a * p0[d] + b * p1[d]) + c * p0[dims + d];
      }
    }
  }
}

CurveError curve_error(const CurveTask& task, const CodedCurve& curve) {
  std::vector<double> fitted;
  evaluate(curve, task.dimensions, 0, task.frames, fitted);
  CurveError out;
  const auto frames = static_cast<std::size_t>(task.frames);
  for (std::size_t f = 0; f < frames; ++f) {
    double distance = 0;
    for (std::size_t d = 0; d < static_cast<std::size_t>(task.dimensions); ++d) {
      const double off = task.at(static_cast<int>(f))[d] - fitted[d * frames + f];
      distance += off * off;
    }
    out.sum += distance;
    if (distance > out.largest) {
      out.largest = distance;
      out.worst = static_cast<int>(f);
    }
  }
  return out;
}

CurveChoice choose_curve(CurveTask task, bool paper) {
  const double limit = task.limit;
  std::vector<int> breaks;
  for (int round = 0;; ++round) {
    // Every other time the numbers alone are chosen anew, more carefully.
    if (round % 2 == 0) breaks = paper ? break_and_fit(task) : choose_breaks(task);
    const CurveShape shape = shape_of(task);
    CurveChoice out{.task = task, .code = encode_curve(shape, choose_numbers(task, breaks))};
    out.error = curve_error(task, decode_curve(shape, out.code, "the curve"));
    constexpr int most_rounds = 60;
    if (out.error.largest <= limit || round == most_rounds) return out;
    ++task.step_index;
    task.rate_weight *= 0.6;
    if (round % 2 == 1) task.limit *= 0.93;
    if (round >= 6) task.grid = 1;
  }
}

}  // namespace kinespace
