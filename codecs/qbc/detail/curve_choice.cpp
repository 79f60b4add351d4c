// The choice of breaks, of numbers, and of all of it together.
#include "kinespace/codecs/qbc/detail/curve_choice.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kinespace/codecs/qbc/detail/banded_system.h"
#include "kinespace/codecs/qbc/quadratic_bezier.h"

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

// The choice of breaks.

namespace {

constexpr int around = 3;                    // segments on either side that make up for a change
constexpr int window_most = 2 * around + 3;  // segments of a window
constexpr double break_bits = 5;
constexpr double violation_bits = 40;    // what a frame beyond the limit counts
constexpr double share_of_limit = 0.72;  // the rest is left to the quantiser

// Connected segments and their control points.
struct Window {
  int segments = 0;
  std::array<int, window_most + 1> at{};
  std::array<SegmentSums, window_most> sums{};
  std::array<Point, window_most + 1> end{};
  std::array<Point, window_most> middle{};
  bool free_first = false;  // the first end is free: the curve starts there
  bool free_last = false;
  double cost = 0;

  [[nodiscard]] int length(int s) const {
    return at[static_cast<std::size_t>(s) + 1] - at[static_cast<std::size_t>(s)];
  }
};

class BreakSearch {
 public:
  BreakSearch(const CurveTask& task, const std::vector<int>& start)
      : task_(task),
        n_(static_cast<std::size_t>(task.dimensions)),
        running_(task),
        next_(static_cast<std::size_t>(task.frames), -1),
        previous_(next_),
        sums_(next_.size()),
        end_(next_.size()),
        middle_(next_.size()),
        changed_(next_.size(), 0),
        moved_(next_.size(), -1),
        filled_(next_.size(), -1) {
    for (std::size_t b = 0; b + 1 < start.size(); ++b) {
      link(start[b], start[b + 1]);
      sums_[index(start[b])] = running_.segment(start[b], start[b + 1]);
    }
    for (const int b : start) std::copy_n(task.at(b), n_, end_[index(b)].begin());
    for (std::size_t b = 0; b + 1 < start.size(); ++b) {
      const BernsteinGram& g = bernstein_gram(start[b + 1] - start[b]);
      const Point &p0 = end_[index(start[b])], &p2 = end_[index(start[b + 1])];
      for (std::size_t d = 0; d < n_; ++d) {
        middle_[index(start[b])][d] = start[b + 1] - start[b] > 1
                                          ? (sums_[index(start[b])].r1[d] - g.g01 * p0[d] - g.g12 * p2[d]) / g.g11
                                          : (p0[d] + p2[d]) / 2;
      }
    }
  }

  std::vector<int> search() {
    constexpr int most_rounds = 7;
    for (int round = 0; round < most_rounds; ++round) {
      const bool moved = move_all();
      const bool inserted = insert_all();
      if (round > 0 && !moved && !inserted) break;
    }
    std::vector<int> out{0};
    while (next_[index(out.back())] >= 0) out.push_back(next_[index(out.back())]);
    return out;
  }

 private:
  static std::size_t index(int frame) { return static_cast<std::size_t>(frame); }
  void link(int first, int last) {
    next_[index(first)] = last;
    previous_[index(last)] = first;
  }
  [[nodiscard]] bool common(int frame) const { return frame % task_.interval == 0 || frame == task_.frames - 1; }
  [[nodiscard]] int snapped(int frame) const {
    const int start = frame / task_.interval * task_.interval;
    return start + (frame - start + task_.grid / 2) / task_.grid * task_.grid;
  }

  // Breaks from `around` before `left` to `around` behind `right`, with `middles` in place of those between.
  template <std::size_t N>
  Window window(int left, int right, const std::array<int, N>& middles, int count) const {
    Window out;
    int first = left;
    for (int i = 0; i < around && previous_[index(first)] >= 0; ++i) first = previous_[index(first)];
    out.at[0] = first;
    const auto add = [&](int frame) { out.at[static_cast<std::size_t>(++out.segments)] = frame; };
    while (out.at[static_cast<std::size_t>(out.segments)] != left) {
      add(next_[index(out.at[static_cast<std::size_t>(out.segments)])]);
    }
    for (int i = 0; i < count; ++i) add(middles[static_cast<std::size_t>(i)]);
    add(right);
    for (int i = 0, last = right; i < around && next_[index(last)] >= 0; ++i) add(last = next_[index(last)]);
    for (int s = 0; s < out.segments; ++s) {
      const int a = out.at[static_cast<std::size_t>(s)], b = out.at[static_cast<std::size_t>(s) + 1];
      out.sums[static_cast<std::size_t>(s)] = next_[index(a)] == b ? sums_[index(a)] : running_.segment(a, b);
    }
    const int last = out.at[static_cast<std::size_t>(out.segments)];
    out.free_first = first == 0;
    out.free_last = last == task_.frames - 1;
    out.end[0] = end_[index(first)];
    out.end[static_cast<std::size_t>(out.segments)] = end_[index(last)];
    fit(out);
    out.cost = cost(out);
    return out;
  }

  // The best control points.
  void fit(Window& w) const {
    const auto m = static_cast<std::size_t>(w.segments);
    std::array<BandedRow, row_count(window_most)> rows;
    std::fill_n(rows.begin(), row_count(m), BandedRow{});
    BandedSystem system(std::span<BandedRow>(rows).first(row_count(m)), n_);
    for (std::size_t s = 0; s < m; ++s) system.add_segment(s, w.length(static_cast<int>(s)), w.sums[s]);
    for (std::size_t s = 1; s < m; ++s) {
      const int before = w.length(static_cast<int>(s) - 1), after = w.length(static_cast<int>(s));
      system.add_smoothness(s, smoothness_ratio(before, after), smoothness_weight(task_, before, after));
    }
    if (w.free_first) {
      system.add_end(0, task_.at(0), 1);
    } else {
      const int before = w.at[0] - previous_[index(w.at[0])], after = w.length(0);
      system.add_smoothness_after(0, smoothness_ratio(before, after), smoothness_weight(task_, before, after),
                                  middle_[index(previous_[index(w.at[0])])].data());
      system.fix(end_row(0), w.end[0].data());
    }
    if (!w.free_last) {
      const int last = w.at[m];
      const int before = w.length(w.segments - 1), after = next_[index(last)] - last;
      system.add_smoothness_before(m, smoothness_ratio(before, after), smoothness_weight(task_, before, after),
                                   middle_[index(last)].data());
      system.fix(end_row(m), w.end[m].data());
    }
    system.eliminate();
    std::array<Point, row_count(window_most)> points;
    for (std::size_t i = 0; i < row_count(m); ++i) {
      for (std::size_t d = 0; d < n_; ++d) points[i][d] = system.best(i, d, points);
    }
    for (std::size_t s = 0; s <= m; ++s) w.end[s] = points[end_row(s)];
    for (std::size_t s = 0; s < m; ++s) w.middle[s] = points[middle_row(s)];
  }

  [[nodiscard]] double cost(const Window& w) const {
    double out = 0;
    if (w.free_first) {
      for (std::size_t d = 0; d < n_; ++d) out += (task_.at(0)[d] - w.end[0][d]) * (task_.at(0)[d] - w.end[0][d]);
    }
    CurvePredictor predictor(shape_of(task_));
    const int before = previous_[index(w.at[0])];
    if (before >= 0) {
      predictor.begin(end_[index(before)].data(), w.at[0] - before, w.at[0] - before);
      predictor.advance(w.at[0] - before, middle_[index(before)].data(), w.end[0].data());
    }
    for (int s = 0; s < w.segments; ++s) {
      out += squared_error(w, s) + task_.rate_weight * bits(w, s, predictor);
    }
    return out;
  }

  [[nodiscard]] double squared_error(const Window& w, int segment) const {
    const auto s = static_cast<std::size_t>(segment);
    const BernsteinGram& g = bernstein_gram(w.length(segment));
    double out = w.sums[s].square;
    for (std::size_t d = 0; d < n_; ++d) {
      const double a = w.end[s][d], b = w.middle[s][d], c = w.end[s + 1][d];
      out += a * (g.g00 * a + 2 * (g.g01 * b + g.g02 * c - w.sums[s].r0[d])) +
             b * (g.g11 * b + 2 * (g.g12 * c - w.sums[s].r1[d])) + c * (g.g22 * c - 2 * w.sums[s].r2[d]);
    }
    return std::max(out, 0.0);
  }

  // An estimate; these coefficients gave the shortest codes of recordings.
  [[nodiscard]] double bits(const Window& w, int segment, CurvePredictor& predictor) const {
    const auto s = static_cast<std::size_t>(segment);
    const int length = w.length(segment);
    const int goal = std::min((w.at[s] / task_.interval + 1) * task_.interval, task_.frames - 1);
    predictor.begin(w.end[s].data(), length, goal - w.at[s]);
    const bool last = w.at[s + 1] == goal;
    const int after = segment + 1 < w.segments ? w.length(segment + 1) : length;
    const double coarse = end_step(quarter_step(task_.step_index), last ? 16 : length, last ? 16 : after);
    const double fine = middle_step(quarter_step(task_.step_index), length);
    double product = 1, count = static_cast<double>(n_);
    for (std::size_t d = 0; d < n_; ++d) {
      // The goal of a common break is not known here; the data is near it.
      const double expected = predictor.end(d, task_.at(goal)[d]);
      const double off = last ? 0 : (w.end[s + 1][d] - expected) / coarse;
      product *= 1 + 4 * off * off;
      if (length < 2) continue;
      const double bend = (w.middle[s][d] - predictor.middle(d, w.end[s + 1][d])) / fine;
      product *= 1 + 4 * bend * bend;
    }
    if (!last && length > 1) count *= 2;
    predictor.advance(length, w.middle[s].data(), w.end[s + 1].data());
    return break_bits + 1.9 * count + 0.5 * std::log2(product);
  }

  // The cost with frames beyond the limit counted; not below `enough` is all that is known above it.
  [[nodiscard]] double full_cost(const Window& w, double enough) const {
    double out = w.cost;
    for (int s = 0; s < w.segments && out < enough; ++s) {
      const double over = worst_frame(w, s).second / (share_of_limit * task_.limit);
      if (over > 1) out += task_.rate_weight * violation_bits * over;
    }
    return out;
  }

  [[nodiscard]] std::pair<int, double> worst_frame(const Window& w, int segment) const {
    const auto s = static_cast<std::size_t>(segment);
    const int length = w.length(segment);
    std::pair<int, double> out{w.at[s] + length / 2, 0};
    const double* p = task_.at(w.at[s] + 1);
    for (int f = 1; f <= length; ++f, p += n_) {
      const double t = static_cast<double>(f) / length;
      const double a = (1 - t) * (1 - t), b = 2 * t * (1 - t), c = t * t;
      double distance = 0;
      for (std::size_t d = 0; d < n_; ++d) {
        const double off = p[d] - a * w.end[s][d] - b * w.middle[s][d] - c * w.end[s + 1][d];
        distance += off * off;
      }
      if (distance > out.second) out = {w.at[s] + f, distance};
    }
    return out;
  }

  void apply(const Window& w, int removed) {
    if (removed >= 0) next_[index(removed)] = previous_[index(removed)] = -1;
    for (std::size_t s = 0; s < static_cast<std::size_t>(w.segments); ++s) {
      link(w.at[s], w.at[s + 1]);
      sums_[index(w.at[s])] = w.sums[s];
      end_[index(w.at[s])] = w.end[s];
      end_[index(w.at[s + 1])] = w.end[s + 1];
      middle_[index(w.at[s])] = w.middle[s];
    }
  }

  // Whether breaks of the window around [left, right] have changed since a change there was last tried.
  [[nodiscard]] bool stale(int left, int right, int tried) const {
    for (int i = 0, b = left; i <= around && b >= 0; ++i, b = previous_[index(b)]) {
      if (changed_[index(b)] > tried) return true;
    }
    for (int i = 0, b = right; i <= around && b >= 0; ++i, b = next_[index(b)]) {
      if (changed_[index(b)] > tried) return true;
    }
    return tried < 0;
  }
  void mark(int left, int right) {
    ++now_;
    for (int b = left; b >= 0 && b <= right; b = next_[index(b)]) changed_[index(b)] = now_;
  }

  // Breaks away, or elsewhere.
  bool move_all() {
    bool changed = false;
    for (int b = next_[0]; b >= 0 && next_[index(b)] >= 0;) {
      const int after = next_[index(b)];
      if (!common(b)) changed |= move(b);
      b = after;
    }
    return changed;
  }
  bool move(int b) {
    const int left = previous_[index(b)], right = next_[index(b)];
    if (!stale(left, right, std::exchange(moved_[index(b)], now_))) return false;
    Window best = window(left, right, std::array{b}, 1);
    best.cost = full_cost(best, 1e300);
    int removed = -1;
    const auto consider = [&](Window candidate) {
      if (candidate.cost >= best.cost) return;
      candidate.cost = full_cost(candidate, best.cost);
      if (candidate.cost >= best.cost - 1e-9) return;
      best = candidate;
      removed = b;
    };
    consider(window(left, right, std::array{b}, 0));
    for (const int steps : {1, -1, 2, -2, 4, -4, 8, -8}) {
      const int to = b + steps * task_.grid;
      if (to > left && to < right) consider(window(left, right, std::array{to}, 1));
    }
    apply(best, removed);
    if (removed >= 0) mark(left, right);
    return removed >= 0;
  }

  bool insert_all() {
    bool changed = false;
    for (int b = 0; next_[index(b)] >= 0; b = next_[index(b)]) {
      if (next_[index(b)] - b >= 2 * task_.grid) changed |= insert(b, next_[index(b)]);
    }
    return changed;
  }
  bool insert(int left, int right) {
    if (!stale(left, right, std::exchange(filled_[index(left)], now_))) return false;
    Window best = window(left, right, std::array{left}, 0);
    best.cost = full_cost(best, 1e300);
    int segment = 0;
    while (best.at[static_cast<std::size_t>(segment)] != left) ++segment;
    const int worst = worst_frame(best, segment).first;
    bool changed = false;
    for (const int at : {worst, (left + right) / 2, (3 * left + right) / 4, (left + 3 * right) / 4}) {
      const int to = snapped(at);
      if (to <= left || to >= right) continue;
      Window candidate = window(left, right, std::array{to}, 1);
      if (candidate.cost >= best.cost) continue;
      candidate.cost = full_cost(candidate, best.cost);
      if (candidate.cost >= best.cost - 1e-9) continue;
      best = candidate;
      changed = true;
    }
    apply(best, -1);
    if (changed) mark(left, right);
    return changed;
  }

  const CurveTask& task_;
  std::size_t n_;
  RunningSums running_;
  std::vector<int> next_, previous_;  // by break frame; -1: none, or no break
  std::vector<SegmentSums> sums_;     // by first frame
  std::vector<Point> end_;
  std::vector<Point> middle_;
  std::vector<int> changed_, moved_, filled_;  // by break frame: when it was, and when that was last tried
  int now_ = 0;
};

std::vector<double> by_dimension(const CurveTask& task) {
  const auto n = static_cast<std::size_t>(task.dimensions);
  const auto frames = static_cast<std::size_t>(task.frames);
  std::vector<double> out(task.values.size());
  for (std::size_t f = 0; f < frames; ++f) {
    for (std::size_t d = 0; d < n; ++d) out[d * frames + f] = task.values[f * n + d];
  }
  return out;
}

}  // namespace

CurveShape shape_of(const CurveTask& task) {
  return {.frames = task.frames,
          .dimensions = task.dimensions,
          .interval = task.interval,
          .grid = task.grid,
          .step_index = task.step_index};
}

std::vector<int> break_and_fit(const CurveTask& task) {
  const BezierCurve curve =
      fit_quadratic_bezier(by_dimension(task), task.dimensions,
                           {.max_squared_distance = share_of_limit * task.limit, .interval = task.interval});
  if (task.grid == 1) return curve.breaks;
  std::vector<int> out{0};
  for (const int b : curve.breaks) {
    const int start = b / task.interval * task.interval;
    const int snapped = b == task.frames - 1 ? b : start + (b - start + task.grid / 2) / task.grid * task.grid;
    const int goal = std::min(start + task.interval, task.frames - 1);
    if (std::min(snapped, goal) > out.back()) out.push_back(std::min(snapped, goal));
  }
  return out;
}

std::vector<int> choose_breaks(const CurveTask& task) {
  return choose_breaks(task, break_and_fit(task));
}

std::vector<int> choose_breaks(const CurveTask& task, const std::vector<int>& start) {
  return task.frames < 3 ? start : BreakSearch(task, start).search();
}

}  // namespace kinespace
