#include "kinespace/repeats/detail/reference_warp.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kinespace {
namespace {

constexpr int most_step = 4;
constexpr float unreachable = std::numeric_limits<float>::infinity();

class Warp {
 public:
  Warp(const Eigen::MatrixXf& repeated, const Eigen::MatrixXf& primary, const std::vector<std::int64_t>& guess,
       const WarpOptions& options)
      : repeated_(repeated),
        primary_(primary),
        guess_(guess),
        options_(options),
        width_(2 * options.reach + 1),
        step_(guess.size() * static_cast<std::size_t>(width_)) {}

  std::vector<std::int64_t> solve() {
    std::vector<float> cost(static_cast<std::size_t>(width_), 0), next(cost.size());
    for (std::size_t t = 0; t < guess_.size(); ++t) {
      advance(t, cost, next);
      cost.swap(next);
    }
    const auto best = std::min_element(cost.begin(), cost.end());
    if (*best == unreachable) return guess_;
    std::vector<std::int64_t> out(guess_.size());
    std::int64_t at = reference(guess_.size() - 1, best - cost.begin());
    for (std::size_t t = guess_.size(); t-- > 0;) {
      out[t] = at;
      at -= step_[index(t, at - reference(t, 0))];
    }
    return out;
  }

 private:
  [[nodiscard]] std::int64_t reference(std::size_t t, std::int64_t k) const { return guess_[t] + k - options_.reach; }
  [[nodiscard]] std::size_t index(std::size_t t, std::int64_t k) const {
    return t * static_cast<std::size_t>(width_) + static_cast<std::size_t>(k);
  }

  void advance(std::size_t t, const std::vector<float>& cost, std::vector<float>& next) {
    const auto column = static_cast<Eigen::Index>(t);
    for (std::int64_t k = 0; k < width_; ++k) {
      const std::int64_t r = reference(t, k);
      float& best = next[static_cast<std::size_t>(k)];
      best = unreachable;
      if (r < 0 || r >= primary_.cols()) continue;
      if (t == 0) {
        best = 0;
      } else {
        for (int step = 0; step <= most_step; ++step) {
          const std::int64_t before = r - step - reference(t - 1, 0);
          if (before < 0 || before >= width_) continue;
          const float sum =
              cost[static_cast<std::size_t>(before)] + options_.jump * static_cast<float>(std::abs(step - 1));
          if (sum >= best) continue;
          best = sum;
          step_[index(t, k)] = static_cast<std::int8_t>(step);
        }
      }
      if (best < unreachable) best += (repeated_.col(column) - primary_.col(r)).squaredNorm();
    }
  }

  const Eigen::MatrixXf& repeated_;
  const Eigen::MatrixXf& primary_;
  const std::vector<std::int64_t>& guess_;
  const WarpOptions& options_;
  std::int64_t width_;
  std::vector<std::int8_t> step_;  // [frame][offset]: frames that the reference moved on
};

}  // namespace

std::vector<std::int64_t> warp_references(const Eigen::MatrixXf& repeated, const Eigen::MatrixXf& primary,
                                          std::vector<std::int64_t> guess, const WarpOptions& options) {
  if (guess.empty()) return guess;
  return Warp(repeated, primary, guess, options).solve();
}

}  // namespace kinespace
