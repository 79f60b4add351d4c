#include "kinespace/codecs/qbc/detail/pole_corrections.h"

#include <algorithm>
#include <cmath>

#include "kinespace/codecs/qbc/detail/curve_choice.h"

namespace kinespace {
namespace {

constexpr double least_bits = 8;  // that a correction takes
constexpr double far_bits = 9;    // what one takes more that does not follow another

double step_bits(std::int32_t steps) {
  return steps == 0 ? 1 : 2 + 2 * std::floor(std::log2(std::abs(steps)));
}

double correction_bits(const FrameCorrection& one, std::size_t turns) {
  double out = 4;
  for (std::size_t t = 0; t < turns; ++t) out += step_bits(one.steps[t]);
  return out;
}

double squared(double x) {
  return x * x;
}

// Calls `visit` with all numbers up to `reach` around `centre`.
template <typename Visit>
void visit_around(int octave, const std::array<std::int32_t, 3>& centre, std::int32_t reach, std::size_t turns,
                  const Visit& visit) {
  const std::int32_t r1 = turns > 1 ? reach : 0, r2 = turns > 2 ? reach : 0;
  for (std::int32_t i = -reach; i <= reach; ++i) {
    for (std::int32_t j = -r1; j <= r1; ++j) {
      for (std::int32_t k = -r2; k <= r2; ++k) {
        visit(FrameCorrection{.octave = octave, .steps = {centre[0] + i, centre[1] + j, centre[2] + k}});
      }
    }
  }
}

}  // namespace

PoleCorrections::PoleCorrections(const Clip& clip, const JointFreedom& root)
    : rule_(root), order_(euler_order(clip.skeleton.joints[static_cast<std::size_t>(root.joint)].channels)) {
  append_turns(clip, root.joint, above_);
  for (int f = 0; f < clip.frames; ++f) {
    const Eigen::Quaterniond local = clip.rotation(root.joint, f).normalized();
    Eigen::Quaterniond& world = above_[static_cast<std::size_t>(f)];
    world = local * world.conjugate();
    file_.push_back(euler_angles(order_, local));
  }
}

double PoleCorrections::squared_error(std::size_t frame, const Point& turns) const {
  Eigen::Quaterniond world;
  rule_.rotations(std::span(turns).first(rule_.turns()), {&world, 1});
  const EulerAngles there = euler_angles(order_, above_[frame] * world, file_[frame]);
  double out = 0;
  for (std::size_t i = 0; i < there.size(); ++i) out += squared(there[i] - file_[frame][i]);
  return out;
}

namespace {

// One frame of the root, for which numbers are sought.
struct PoleFrame {
  const double* goal = nullptr;  // position and turns
  Point curved{};                // turns
  double position = 0;           // squared distance
};

// Calls `visit` for the numbers worth a try.
template <typename Visit>
void visit_numbers(const PoleFrame& frame, std::size_t turns, int step_index, const Visit& visit) {
  for (int octave = 0; octave < FrameCorrection::octaves; ++octave) {
    const double step = quarter_step(step_index + 4 * octave);
    std::array<std::int32_t, 3> nearest{};
    bool small = true;
    for (std::size_t t = 0; t < turns; ++t) {
      const double exact = (frame.goal[t + 3] - frame.curved[t]) / step;
      small &= std::abs(exact) < (1 << (FrameCorrection::digits - 1));
      if (small) nearest[t] = static_cast<std::int32_t>(std::lround(exact));
    }
    if (small) visit_around(octave, nearest, 1, turns, visit);
    visit_around(octave, {}, 3, turns, visit);
  }
}

}  // namespace

std::vector<FrameCorrection> PoleCorrections::choose(const CurveTask& task, const CodedCurve& curve) const {
  std::vector<FrameCorrection> out;
  const std::size_t turns = rule_.turns();
  const auto n = static_cast<std::size_t>(task.frames);
  std::vector<double> fitted;
  evaluate(curve, task.dimensions, 0, task.frames, fitted);
  for (std::size_t f = 0; f < n; ++f) {
    PoleFrame frame{.goal = task.at(static_cast<int>(f))};
    for (std::size_t d = 0; d < 3; ++d) frame.position += squared(frame.goal[d] - fitted[d * n + f]);
    for (std::size_t t = 0; t < turns; ++t) frame.curved[t] = fitted[(t + 3) * n + f];
    const bool follows = !out.empty() && out.back().frame + 1 == static_cast<int>(f);
    FrameCorrection best{.frame = -1};
    double least = squared_error(f, frame.curved);
    if (least <= least_bits * task.rate_weight) continue;
    visit_numbers(frame, turns, curve.step_index, [&](FrameCorrection one) {
      const double bits = correction_bits(one, turns) + (follows ? 0 : far_bits);
      if (bits * task.rate_weight >= least) return;
      double distance = frame.position;
      Point angles{};
      for (std::size_t t = 0; t < turns; ++t) {
        angles[t] = frame.curved[t] + one.turn(t, curve.step_index);
        distance += squared(frame.goal[t + 3] - angles[t]);
      }
      if (distance > task.limit) return;
      const double cost = squared_error(f, angles) + bits * task.rate_weight;
      if (cost >= least) return;
      least = cost;
      best = one;
      best.frame = static_cast<int>(f);
    });
    if (best.frame >= 0) out.push_back(best);
  }
  return out;
}

}  // namespace kinespace
