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

using Movement = SequenceCutter::Movement;

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

// Appends the cuts after `first` up to `last`, in motion that is not cyclic.
void cut_at_rests(const Movement& movement, int first, int last, double rate_hz, const SequenceOptions& options,
                  Run& run) {
  const int n = last - first;
  const auto [shortest, longest] = legal_lengths(n, rate_hz, options);
  if (n <= longest) {
    run.cuts.push_back(last);
    run.cycles.push_back(0);
    return;
  }

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
  const auto kept = static_cast<std::ptrdiff_t>(run.cuts.size());
  for (int i = n; i > 0; i = from[static_cast<std::size_t>(i)]) run.cuts.push_back(first + i);
  std::reverse(run.cuts.begin() + kept, run.cuts.end());
  run.cycles.resize(run.cuts.size() - 1, 0);
}

// Appends sequences of whole cycles, as many cycles each as may be.
void cut_cycles(const CyclicStretch& stretch, const SequenceOptions& options, Run& run) {
  const int cycles = stretch.cycles();
  for (int at = 0; at < cycles;) {
    const int held = std::min(options.most_cycles, cycles - at);
    at += held;
    run.cuts.push_back(stretch.marks[static_cast<std::size_t>(at)]);
    run.cycles.push_back(static_cast<std::uint8_t>(held));
  }
}

Run equal_windows(const Run& run) {
  Run out{{run.cuts.front()}};
  const int sequences = run.sequence_count();
  const int first = run.cuts.front();
  const int frames = run.cuts.back() - first;
  for (int i = 1; i <= sequences && frames > 0; ++i) {
    out.cuts.push_back(first + static_cast<int>(std::lround(static_cast<double>(i) * frames / sequences)));
  }
  return out;
}

Run cut_run(const Movement& movement, const std::vector<CyclicStretch>& stretches, int first, int last, double rate_hz,
            const SequenceOptions& options) {
  Run run{{first}};
  for (const CyclicStretch& stretch : stretches) {
    if (stretch.marks.front() > run.cuts.back()) {
      cut_at_rests(movement, run.cuts.back(), stretch.marks.front(), rate_hz, options, run);
    }
    const int sequence = static_cast<int>(run.cycles.size());
    cut_cycles(stretch, options, run);
    Run at_rests{{stretch.marks.front()}};
    cut_at_rests(movement, stretch.marks.front(), stretch.marks.back(), rate_hz, options, at_rests);
    run.at_rests.push_back({sequence, static_cast<int>(run.cycles.size()) - sequence, std::move(at_rests.cuts)});
  }
  if (last > run.cuts.back()) cut_at_rests(movement, run.cuts.back(), last, rate_hz, options, run);
  return options.equal_windows ? equal_windows(run) : run;
}

}  // namespace

void SequenceOptions::validate() const {
  require_option(most_cycles >= 0 && most_cycles <= 8, "most_cycles", most_cycles, "0 to 8");
  cycles.validate();
  require_option(shortest_s > 0, "shortest_s", shortest_s, "seconds above 0");
  require_option(longest_s > shortest_s && std::isfinite(longest_s), "longest_s", longest_s,
                 "seconds above shortest_s");
  require_option(length_weight >= 0, "length_weight", length_weight, "0 or more");
  require_option(jerk_weight >= 0, "jerk_weight", jerk_weight, "0 or more");
  require_option(break_cm > 0, "break_cm", break_cm, "centimetres above 0");
  require_option(break_ratio > 1, "break_ratio", break_ratio, "more than 1");
}

SequenceCutter::SequenceCutter(const Clip& clip, const SequenceOptions& options) : options_(options) {
  options_.validate();
  movement_ = measure_movement(clip, options_);
}

std::vector<Run> SequenceCutter::cut(const ClipCurves& curves, const Skeleton& skeleton) const {
  std::vector<Run> runs;
  int first = 0;
  const auto add_run = [&](int last) {
    std::vector<CyclicStretch> stretches;
    if (options_.most_cycles > 0) stretches = find_cycles(curves, skeleton, first, last, options_.cycles);
    runs.push_back(cut_run(movement_, stretches, first, last, curves.rate_hz, options_));
    first = last + 1;
  };
  for (const int f : movement_.breaks) add_run(f);
  add_run(curves.frames() - 1);
  return runs;
}

std::vector<Run> cut_sequences(const Clip& clip, const SequenceOptions& options) {
  return SequenceCutter(clip, options).cut(clip_curves(clip), clip.skeleton);
}

}  // namespace kinespace
