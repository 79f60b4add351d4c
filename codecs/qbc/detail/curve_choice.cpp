// The choice of numbers, and of all of it together.
#include "kinespace/codecs/qbc/detail/curve_choice.h"

#include <algorithm>
#include <cmath>

#include "kinespace/codecs/qbc/detail/banded_system.h"

namespace kinespace {
namespace {

class NumberChoice {
 public:
  NumberChoice(const CurveTask& task, const std::vector<int>& breaks)
      : task_(task),
        shape_(shape_of(task)),
        n_(static_cast<std::size_t>(task.dimensions)),
        predictor_(shape_),
        context_(task.dimensions) {
    out_.breaks = breaks;
    const RunningSums running(task);
    for (std::size_t s = 0; s + 1 < breaks.size(); ++s) sums_.push_back(running.segment(breaks[s], breaks[s + 1]));
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

  // The system of segments [first, last).
  [[nodiscard]] BandedSystem system_of(std::size_t first, std::size_t last) {
    rows_.assign(row_count(last - first), {});
    BandedSystem out(rows_, n_);
    for (std::size_t s = first; s < last; ++s) {
      out.add_segment(s - first, length(s), sums_[s]);
      if (s > first) out.add_smoothness(s - first, ratio_at(s), weight_at(s));
    }
    return out;
  }
  // Of the kink between a segment and the one before.
  [[nodiscard]] double ratio_at(std::size_t s) const { return smoothness_ratio(length(s - 1), length(s)); }
  [[nodiscard]] double weight_at(std::size_t s) const { return smoothness_weight(task_, length(s - 1), length(s)); }

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
    const std::size_t segments = out_.breaks.size() - 1;
    BandedSystem system = system_of(0, segments);
    system.add_end(0, task_.at(0), 1);
    system.eliminate();
    free_.assign(rows_.size(), {});
    for (std::size_t i = 0; i < free_.size(); ++i) {
      for (std::size_t d = 0; d < n_; ++d) free_[i][d] = system.best(i, d, free_);
    }
    const double step = end_step(shape_.step(), 16, 16);
    common_.assign(static_cast<std::size_t>(shape_.interval_count()) + 1, {});
    std::size_t b = 0;
    for (std::size_t i = 0; i < common_.size(); ++i) {
      while (out_.breaks[b] != shape_.common_break(static_cast<int>(i))) ++b;
      context_.begin_point(1);
      const std::size_t row = end_row(b);
      for (std::size_t d = 0; d < n_; ++d) {
        const double before = i > 0 ? common_[i - 1][d] : 0, earlier = i > 1 ? common_[i - 2][d] : 0;
        const double expected = expected_common(static_cast<int>(i), before, earlier);
        const std::int64_t number =
            best_number(PointKind::common, d, expected, step, free_[row][d], system.weight(row));
        common_[i][d] = expected + static_cast<double>(number) * step;
        out_.common.push_back(number);
      }
    }
  }

  // Segments [first, last), whose outer ends are fixed.
  void choose_interval(std::size_t first, std::size_t last, std::size_t interval) {
    const Point& goal = common_[interval + 1];
    BandedSystem system = system_of(first, last);
    const std::size_t m = last - first;
    if (first > 0) system.add_smoothness_after(0, ratio_at(first), weight_at(first), middle_.data());
    if (last + 1 < out_.breaks.size()) {
      system.add_smoothness_before(m, ratio_at(last), weight_at(last), free_[middle_row(last)].data());
    }
    system.fix(end_row(0), common_[interval].data());
    system.fix(end_row(m), goal.data());
    system.eliminate();
    std::vector<Point> known(row_count(m));
    known[0] = common_[interval];
    for (std::size_t s = 0; s < m; ++s) {
      const int frames = length(first + s);
      const int rest = out_.breaks[last] - out_.breaks[first + s];
      predictor_.begin(known[end_row(s)].data(), frames, rest);
      Point& end = known[end_row(s + 1)];
      end = goal;
      context_.begin_point(frames);
      if (s + 1 < m) {
        const double step = end_step(shape_.step(), frames, length(first + s + 1));
        for (std::size_t d = 0; d < n_; ++d) {
          choose_number(PointKind::end, d, predictor_.end(d, goal[d]), step, system, end_row(s + 1), known);
        }
      }
      context_.begin_point(frames);
      const double step = middle_step(shape_.step(), frames);
      for (std::size_t d = 0; d < n_; ++d) {
        const double expected = predictor_.middle(d, end[d]);
        known[middle_row(s)][d] = expected;
        if (frames > 1) choose_number(PointKind::middle, d, expected, step, system, middle_row(s), known);
      }
      middle_ = known[middle_row(s)];
      predictor_.advance(frames, middle_.data(), end.data());
    }
  }

  void choose_number(PointKind kind, std::size_t d, double expected, double step, const BandedSystem& system,
                     std::size_t row, std::vector<Point>& known) {
    const std::int64_t number = best_number(kind, d, expected, step, system.best(row, d, known), system.weight(row));
    known[row][d] = expected + static_cast<double>(number) * step;
    out_.points.push_back(number);
  }

  const CurveTask& task_;
  CurveShape shape_;
  std::size_t n_;
  CurvePredictor predictor_;
  SizeContext context_;
  CurveNumbers out_;
  std::vector<SegmentSums> sums_;
  std::vector<BandedRow> rows_;
  std::vector<Point> free_, common_;
  Point middle_{};  // of the segment before
};

}  // namespace

double smoothness_ratio(int length_before, int length_after) {
  return static_cast<double>(length_after) / length_before;
}

double smoothness_weight(const CurveTask& task, int length_before, int length_after) {
  if (length_before < 2 || length_after < 2) return 0;
  const double ratio = smoothness_ratio(length_before, length_after);
  const double step = middle_step(quarter_step(task.step_index), length_after);
  return task.smoothness * task.rate_weight / (step * step * (1 + ratio * ratio));
}

CurveNumbers choose_numbers(const CurveTask& task, const std::vector<int>& breaks) {
  return NumberChoice(task, breaks).choose();
}

namespace {

void correct(const CodedCurve& curve, std::size_t dimensions, int first, int count, std::vector<double>& out) {
  const auto n = static_cast<std::size_t>(count);
  auto one = std::ranges::lower_bound(curve.corrections, first, {}, &FrameCorrection::frame);
  for (; one != curve.corrections.end() && one->frame < first + count; ++one) {
    for (std::size_t d = 3; d < dimensions; ++d) {
      out[d * n + static_cast<std::size_t>(one->frame - first)] += one->turn(d - 3, curve.step_index);
    }
  }
}

}  // namespace

void evaluate(const CodedCurve& curve, int dimensions, int first, int count, std::vector<double>& out) {
  const auto n = static_cast<std::size_t>(count);
  const auto dims = static_cast<std::size_t>(dimensions);
  out.resize(dims * n);
  if (curve.breaks.size() < 2) {
    for (std::size_t d = 0; d < dims; ++d) out[d * n] = curve.ends[d];
    correct(curve, dims, first, count, out);
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
  correct(curve, dims, first, count, out);
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

namespace {

CurveChoice code_with(const CurveTask& task, const std::vector<int>& breaks) {
  const CurveShape shape = shape_of(task);
  CurveChoice out{.task = task, .numbers = choose_numbers(task, breaks)};
  out.code = encode_curve(shape, out.numbers);
  out.error = curve_error(task, decode_curve(shape, out.code, "the curve"));
  return out;
}

CurveChoice within_limit(CurveTask task, bool paper) {
  const double limit = task.limit;
  std::vector<int> breaks;
  for (int round = 0;; ++round) {
    // Every other time the numbers alone are chosen anew, more carefully.
    if (round % 2 == 0) breaks = paper ? break_and_fit(task) : choose_breaks(task);
    CurveChoice out = code_with(task, breaks);
    constexpr int most_rounds = 60;
    if (out.error.largest <= limit || round == most_rounds) return out;
    ++task.step_index;
    task.rate_weight *= 0.6;
    if (round % 2 == 1) task.limit *= 0.93;
    if (round >= 6) task.grid = 1;
  }
}

}  // namespace

CurveChoice choose_curve(const CurveTask& task, bool paper) {
  CurveChoice best = within_limit(task, paper);
  constexpr int longest = 16384;  // longer ones take the first choice
  if (paper || task.frames > longest) return best;
  const auto cost = [&](const CurveChoice& choice) {
    return choice.error.sum + task.rate_weight * 8 * static_cast<double>(choice.code.size());
  };
  const auto consider = [&](CurveTask other) {
    const bool near = other.grid == best.task.grid;
    if (other.step_index == best.task.step_index && other.grid == best.task.grid) return false;
    CurveChoice choice = code_with(other, near ? choose_breaks(other, best.numbers.breaks) : choose_breaks(other));
    if (choice.error.largest > task.limit || cost(choice) >= cost(best)) return false;
    best = std::move(choice);
    return true;
  };
  CurveTask regridded = task;
  for (regridded.grid = 2 * task.grid; regridded.grid <= 8 * task.grid; regridded.grid *= 2) {
    if (!consider(regridded)) break;
  }
  regridded.grid = task.grid / 2;
  if (best.task.grid == task.grid && task.grid > 1) consider(regridded);
  for (const int steps : {2, -2}) {
    CurveTask other = task;
    other.grid = best.task.grid;
    other.step_index = best.task.step_index + steps;
    if (consider(other)) break;
  }
  return best;
}

}  // namespace kinespace
