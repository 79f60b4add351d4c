#include "kinespace/fpca/sequences.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

void require_option(bool legal, const char* field, double value, const char* range) {
  if (legal) return;
  throw Error(ErrorKind::usage, {.found = fmt::format("SequenceOptions::{} = {}", field, value), .expected = range});
}

// What the cuts and the breaks are chosen by, frame by frame.
struct Movement {
  std::vector<double> mean_square_speed;  // (cm/s)^2, mean over joints
  std::vector<double> speed_change;       // cm/s, largest over joints
  std::vector<int> breaks;                // frames f after which the body is elsewhere
};

// Steps between consecutive frames (cm, by joint), five at a time, so that a long clip needs no table of positions.
class StepWindow {
 public:
  explicit StepWindow(std::size_t joints) : steps_(5, std::vector<double>(joints, 0.0)) {}
  void push(const std::vector<double>& step) {
    std::rotate(steps_.begin(), steps_.begin() + 1, steps_.end());
    steps_.back() = step;
  }
  // 0 is the oldest of the five.
  [[nodiscard]] const std::vector<double>& at(std::size_t i) const { return steps_[i]; }

 private:
  std::vector<std::vector<double>> steps_;
};

bool is_break(const StepWindow& w, const SequenceOptions& options) {
  const auto& step = w.at(2);
  for (std::size_t j = 0; j < step.size(); ++j) {
    const double around = std::max(std::max(w.at(0)[j], w.at(1)[j]), std::max(w.at(3)[j], w.at(4)[j]));
    if (step[j] > options.break_cm && step[j] > options.break_ratio * around) return true;
  }
  return false;
}

Movement measure_movement(const Clip& clip, const SequenceOptions& options) {
  const auto frames = static_cast<std::size_t>(clip.frames);
  const auto joints = clip.skeleton.joints.size();
  Movement out{std::vector<double>(frames, 0.0), std::vector<double>(frames, 0.0), {}};
  StepWindow window(joints);
  std::vector<JointFrame> before, now;
  std::vector<double> step(joints, 0.0);
  world_frames(clip, 0, before);
  // Two steps more than there are, of no length, so that the last ones pass the middle of the window.
  for (std::size_t f = 0; f + 1 < frames + 2; ++f) {
    if (f + 1 < frames) {
      world_frames(clip, static_cast<int>(f + 1), now);
      for (std::size_t j = 0; j < joints; ++j) step[j] = (now[j].position - before[j].position).norm();
      std::swap(before, now);
    } else {
      std::ranges::fill(step, 0.0);
    }
    window.push(step);
    if (f < 2) continue;
    const std::size_t frame = f - 2;  // the middle of the window is the step frame -> frame + 1
    if (frame + 1 < frames && is_break(window, options)) out.breaks.push_back(static_cast<int>(frame));
    if (frame == 0) continue;
    double square = 0;
    double change = 0;
    for (std::size_t j = 0; j < joints; ++j) {
      const double mean = (window.at(1)[j] + window.at(2)[j]) / 2;
      square += mean * mean;
      change = std::max(change, std::abs(window.at(2)[j] - window.at(1)[j]));
    }
    out.mean_square_speed[frame] = square / static_cast<double>(joints) * clip.rate_hz * clip.rate_hz;
    out.speed_change[frame] = change * clip.rate_hz;
  }
  return out;
}

// What a cut costs at each frame of a run, without units. Empty for runs that are not cut.
std::vector<double> cut_costs(const Movement& movement, int first, int last, double jerk_weight) {
  const auto n = static_cast<std::size_t>(last - first + 1);
  std::vector<double> cost(movement.mean_square_speed.begin() + first, movement.mean_square_speed.begin() + last + 1);
  std::vector<double> change(movement.speed_change.begin() + first, movement.speed_change.begin() + last + 1);
  double mean = 0;
  for (const double c : cost) mean += c / static_cast<double>(n);
  std::vector<double> sorted = change;
  const auto rank = static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(n - 1));
  std::ranges::nth_element(sorted, sorted.begin() + rank);
  const double typical = sorted[static_cast<std::size_t>(rank)];
  constexpr double nothing = 1e-9;  // a body at rest costs the same everywhere
  for (std::size_t i = 0; i < n; ++i) {
    const double jerk = change[i] / (typical + nothing);
    cost[i] = cost[i] / (mean + nothing) + jerk_weight * jerk * jerk;
  }
  return cost;
}

struct Lengths {
  int shortest;
  int longest;
};

// The legal lengths as steps between the first and the last of that many frames; widened where no number of legal
// sequences adds up to n steps.
Lengths legal_lengths(int n, double rate_hz, const SequenceOptions& options) {
  constexpr double rounding = 1e-9;  // 0.8 s at 30 Hz are 24 frames, not 25
  const int longest = std::max(1, static_cast<int>(std::floor(options.longest_s * rate_hz + rounding)) - 1);
  const int shortest = std::clamp(static_cast<int>(std::ceil(options.shortest_s * rate_hz - rounding)) - 1, 1, longest);
  const int fewest = (n + longest - 1) / longest;
  return {std::min(shortest, n / fewest), longest};
}

Run cut_run(const Movement& movement, int first, int last, double rate_hz, const SequenceOptions& options) {
  const int n = last - first;
  if (n == 0) return {{first}};
  const auto [shortest, longest] = legal_lengths(n, rate_hz, options);
  if (n <= longest) return {{first, last}};

  const std::vector<double> cost = cut_costs(movement, first, last, options.jerk_weight);
  std::vector<double> best(static_cast<std::size_t>(n) + 1, std::numeric_limits<double>::infinity());
  std::vector<int> from(best.size(), -1);
  best[0] = 0;
  for (int i = shortest; i <= n; ++i) {
    for (int k = std::max(0, i - longest); k <= i - shortest; ++k) {
      const double x = ((i - k + 1) / rate_hz - options.shortest_s) / (options.longest_s - options.shortest_s);
      const double length = options.length_weight * (0.4 * x + 0.6 * x * std::abs(x));
      const double total = best[static_cast<std::size_t>(k)] + length;
      if (total < best[static_cast<std::size_t>(i)]) {
        best[static_cast<std::size_t>(i)] = total;
        from[static_cast<std::size_t>(i)] = k;
      }
    }
    if (i < n) best[static_cast<std::size_t>(i)] += cost[static_cast<std::size_t>(i)];
  }
  Run run;
  for (int i = n; i >= 0; i = from[static_cast<std::size_t>(i)]) run.cuts.push_back(first + i);
  std::ranges::reverse(run.cuts);
  return run;
}

}  // namespace

void SequenceOptions::validate() const {
  require_option(shortest_s > 0, "shortest_s", shortest_s, "seconds above 0");
  require_option(longest_s > shortest_s && std::isfinite(longest_s), "longest_s", longest_s,
                 "seconds above shortest_s");
  require_option(length_weight >= 0, "length_weight", length_weight, "0 or more");
  require_option(jerk_weight >= 0, "jerk_weight", jerk_weight, "0 or more");
  require_option(break_cm > 0, "break_cm", break_cm, "centimetres above 0");
  require_option(break_ratio > 1, "break_ratio", break_ratio, "more than 1");
}

std::vector<Run> cut_sequences(const Clip& clip, const SequenceOptions& options) {
  options.validate();
  const Movement movement = measure_movement(clip, options);
  std::vector<Run> runs;
  int first = 0;
  for (const int f : movement.breaks) {
    runs.push_back(cut_run(movement, first, f, clip.rate_hz, options));
    first = f + 1;
  }
  runs.push_back(cut_run(movement, first, clip.frames - 1, clip.rate_hz, options));
  return runs;
}

}  // namespace kinespace
