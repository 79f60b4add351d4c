// Frame tables whose segments, periods and repetitions are known.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <Eigen/QR>

#include "kinespace/repeats/frame_table.h"

namespace kinespace::test {

inline FrameTable empty_table(int dimensions, double rate_hz) {
  return {.rate_hz = rate_hz, .dimensions = dimensions, .frames = 0, .values = {}, .starts = {}};
}

// Adds a clip of `frames` frames that posture(t) gives, t in frames of this clip.
inline void add_clip(FrameTable& table, int frames, const std::function<Eigen::VectorXd(double)>& posture) {
  table.starts.push_back(table.frames);
  for (int t = 0; t < frames; ++t) {
    const Eigen::VectorXd x = posture(t);
    for (Eigen::Index d = 0; d < x.size(); ++d) table.values.push_back(static_cast<float>(x(d)));
  }
  table.frames += frames;
}

// A closed curve in `dimensions` numbers: the posture at a phase (1: once round). Two harmonics, in directions that
// `behaviour` chooses, some 30 units wide: no posture comes twice in a cycle.
class Cycle {
 public:
  Cycle(int dimensions, int behaviour) : mean_(dimensions) {
    Eigen::MatrixXd directions(dimensions, 4);
    for (Eigen::Index i = 0; i < directions.size(); ++i) {
      directions(i) = std::sin(static_cast<double>((i + 1) * (behaviour + 2)) * 1.7 + behaviour);
    }
    axes_ = Eigen::HouseholderQR<Eigen::MatrixXd>(directions).householderQ() * Eigen::MatrixXd::Identity(dimensions, 4);
    for (Eigen::Index d = 0; d < mean_.size(); ++d) mean_(d) = 20 * std::cos(static_cast<double>(d * (behaviour + 1)));
  }
  [[nodiscard]] Eigen::VectorXd operator()(double phase) const {
    const double a = 2 * std::numbers::pi * phase;
    return mean_ +
           axes_ * Eigen::Vector4d(30 * std::cos(a), 25 * std::sin(a), 8 * std::cos(2 * a), 8 * std::sin(2 * a));
  }

 private:
  Eigen::VectorXd mean_;
  Eigen::MatrixXd axes_;
};

// A motion that never comes back: straight on through space, and round it ever wider.
inline Eigen::VectorXd one_way(int dimensions, double t) {
  Eigen::VectorXd x(dimensions);
  for (Eigen::Index d = 0; d < x.size(); ++d) {
    x(d) = 0.7 * t * std::cos(static_cast<double>(d)) + 3 * std::sin(0.01 * t * static_cast<double>(d + 1));
  }
  return x;
}

}  // namespace kinespace::test
