#include "kinespace/codecs/pose_space/detail/pose_space_search.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/stream/target_search.h"

namespace kinespace {
namespace {

// Steps for errors: what both the 30 Hz and the 120 Hz recordings of the benches need, to within a factor of 2.
double step_for(double mean_error_cm) {
  return 7 * mean_error_cm;
}

}  // namespace

PoseSpaceSearch::PoseSpaceSearch(std::span<const Clip> clips, const Progress& progress, PoseSpaceSettings settings,
                                 double shell_ratio, const PoseSpaceBasis* basis)
    : encoder_(clips, progress, basis), settings_(settings), shell_ratio_(shell_ratio), basis_(basis) {
  const std::int64_t groups = encoder_.frames() / settings_.group_frames;
  sample_ = static_cast<int>(std::clamp<std::int64_t>(groups / 4, 2, 64));
}

Bytes PoseSpaceSearch::at_step(double step) {
  settle(step);
  return encoder_.finish(encoder_.attempt(step, settings_, &*last_));
}

Bytes PoseSpaceSearch::for_mean_error(double target) {
  double step = step_for(target);
  encoder_.plan(step, settings_);
  step = approach(step, target);
  step = balance(step, target);
  // The sample is not the whole: correct on the whole until the bound holds.
  constexpr int most_rounds = 12;
  double goal = target;
  for (int round = 0; round < most_rounds; ++round) {
    Attempt attempt = encoder_.attempt(step, settings_, &*last_);
    const double error = attempt.error.mean_cm();
    const bool met = error <= target;
    const bool close = error >= 0.98 * target || error == 0;
    const bool shell =
        basis_ != nullptr || attempt.error.shell_cm() <= shell_ratio_ * std::max(error, 1e-9) || error == 0;
    if (!shell && round + 1 < most_rounds) {
      settings_.shell_weight *= 1.3;
      encoder_.weigh_again(settings_);
      continue;
    }
    if (met && (close || round > 4)) {
      Bytes out = encoder_.finish(attempt);
      if (Bitstream::parse(out, "").error().mean_joint_error_cm <= target) return out;
    }
    if (!met) goal = std::min(goal, target) * 0.998;
    step *= std::clamp(std::pow(goal / std::max(error, 1e-12), 1.1), 0.25, 4.0);
  }
  cannot_meet(fmt::format("a mean joint error of {} cm", target), "a larger one");
}

Bytes PoseSpaceSearch::for_max_error(double target) {
  // Coarser steps leave more windows to refine; the best of a few starts.
  Bytes best;
  double step = step_for(target / 3.5);
  settle(step);
  for (int start = 0; start < 4; ++start, step /= 1.35) {
    Bytes out = refine(step, target);
    if (!out.empty() && (best.empty() || out.size() < best.size())) {
      best = std::move(out);
    } else if (!best.empty()) {
      break;
    }
  }
  if (best.empty()) cannot_meet(fmt::format("a largest joint error of {} cm", target), "a larger one");
  return best;
}

Bytes PoseSpaceSearch::for_bytes(std::int64_t target) {
  constexpr SearchRange range{.start = 2.5, .least = 1e-4, .most = 1e5, .rounds = 16};
  settle(range.start);
  return search_target({.bytes = target}, range, [&](double step) {
    return CodedAttempt{.stream = encoder_.finish(encoder_.attempt(step, settings_, &*last_)), .error = {}};
  });
}

// Plans for this step and finds the shell weight that just holds the ratio, on the sample.
void PoseSpaceSearch::settle(double step) {
  encoder_.plan(step, settings_);
  sample_at(step);
  balance(step, {});
}

void PoseSpaceSearch::sample_at(double step) {
  PoseSpaceSettings sampled = settings_;
  sampled.sample = sample_;
  last_ = encoder_.attempt(step, sampled, last_ ? &*last_ : nullptr);
}

// Steps on the sample until its error is near the target.
double PoseSpaceSearch::approach(double step, double target) {
  constexpr int most_rounds = 6;
  for (int round = 0; round < most_rounds; ++round) {
    sample_at(step);
    const double error = last_->error.mean_cm();
    if (!(error > 0)) return step;
    const double factor = target / error;
    step *= std::clamp(std::pow(factor, 1.15), 0.1, 4.0);
    if (factor > 0.985 && factor < 1.015) break;
  }
  return step;
}

// Moves the shell weight until the ratio of the errors is just held. With a target, the step follows.
double PoseSpaceSearch::balance(double step, std::optional<double> target) {
  constexpr int most_rounds = 5;
  constexpr double lightest = 0.004;
  if (basis_ != nullptr) return step;  // it has its own weight
  for (int round = 0; round < most_rounds; ++round) {
    const double error = last_->error.mean_cm();
    if (!(error > 0)) break;
    const double ratio = last_->error.shell_cm() / error / shell_ratio_;
    const bool light = settings_.shell_weight <= lightest && ratio < 1;
    if (light || (ratio > 0.96 && ratio < 0.99)) break;
    // The ratio falls with about the tenth root of the weight.
    const double factor = std::pow(ratio / 0.975, 8);
    settings_.shell_weight = std::max(lightest, settings_.shell_weight * std::clamp(factor, 0.15, 4.0));
    encoder_.weigh_again(settings_);
    sample_at(step);
    if (target && last_->error.mean_cm() > 0) {
      step *= std::clamp(std::pow(*target / last_->error.mean_cm(), 1.15), 0.25, 4.0);
    }
  }
  return step;
}

// Makes the windows finer that are off by more; empty when some cannot be.
Bytes PoseSpaceSearch::refine(double step, double target) {
  std::vector<int> finer(encoder_.window_count(), 0);
  constexpr int most_rounds = 40;
  for (int round = 0; round < most_rounds; ++round) {
    const Attempt attempt = encoder_.attempt(step, settings_, &*last_, finer);
    bool met = true;
    for (std::size_t w = 0; w < finer.size(); ++w) {
      const double error = attempt.largest[w];
      if (error <= target) continue;
      met = false;
      const int more = std::max(1, static_cast<int>(std::lround(1.7 * std::log2(error / target))));
      finer[w] += more;
      if (finer[w] > finest_block) return {};
    }
    if (!met) continue;
    Bytes out = encoder_.finish(attempt);
    if (Bitstream::parse(out, "").error().max_joint_error_cm <= target) return out;
    target *= 0.999;
  }
  return {};
}

PoseSpaceTables PoseSpaceSearch::tables_at(double step, bool all_components) {
  settle(step);
  settings_.all_components = all_components;
  return encoder_.attempt(step, settings_, &*last_).tables;
}

}  // namespace kinespace
