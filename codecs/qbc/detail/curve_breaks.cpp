// The choice of breaks.
#include <algorithm>
#include <cmath>
#include <utility>

#include "kinespace/codecs/qbc/detail/banded_system.h"
#include "kinespace/codecs/qbc/detail/curve_choice.h"
#include "kinespace/codecs/qbc/quadratic_bezier.h"

namespace kinespace {
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
