#include "kinespace/footskate/detail/knee_bends.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace kinespace {
namespace {

constexpr double jerk_rad_s2 = 15;  // a second difference of the knee's angle that counts as much as a miss of `give`
constexpr double home_rad = 3;      // and a change of it
constexpr int bend_rounds = 10;

// A symmetric positive definite matrix of five diagonals, by its lower half: [row][column - row + 2].
using Band = std::vector<std::array<double, 3>>;

// Solves band * x = right, both in place: Cholesky without roots.
void solve_band(Band& band, std::vector<double>& right) {
  const std::size_t count = band.size();
  for (std::size_t i = 0; i < count; ++i) {
    auto& [second, first, own] = band[i];
    if (i >= 1) {
      if (i >= 2) first -= second * band[i - 2][2] * band[i - 1][1];
      first /= band[i - 1][2];
    }
    if (i >= 2) own -= second * second * band[i - 2][2];
    if (i >= 1) own -= first * first * band[i - 1][2];
    if (i + 2 < count) band[i + 2][0] /= own;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (i >= 1) right[i] -= band[i][1] * right[i - 1];
    if (i >= 2) right[i] -= band[i][0] * right[i - 2];
  }
  for (std::size_t i = 0; i < count; ++i) right[i] /= band[i][2];
  for (std::size_t i = count; i-- > 0;) {
    if (i + 1 < count) right[i] -= band[i + 1][1] * right[i + 1];
    if (i + 2 < count) right[i] -= band[i + 2][0] * right[i + 2];
  }
}

// Of a run of frames that change, [first, last): the changes of the bends. What lies beside the run does not change.
class Run {
 public:
  Run(const std::vector<LegWish>& wishes, std::size_t first, std::size_t last, double rate_hz, double give_cm)
      : wishes_(wishes),
        first_(first),
        count_(last - first),
        give_cm_(give_cm),
        stiff_(std::pow(rate_hz, 4) / (jerk_rad_s2 * jerk_rad_s2)) {
    for (std::size_t i = 0; i < count_; ++i) {
      const LegWish& leg = wishes_[first_ + i];
      change_.push_back(leg.hinge.bend_for(leg.reach) - leg.hinge.bend);
    }
  }

  void solve(std::vector<double>& bends) {
    for (int round = 0; round < bend_rounds; ++round) improve();
    for (std::size_t i = 0; i < count_; ++i) bends[first_ + i] = bend(i);
  }

 private:
  // One step of Gauss and Newton.
  void improve() {
    Band band(count_, {0, 0, 0});
    std::vector<double> right(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      const LegWish& leg = wishes_[first_ + i];
      const double reach = leg.hinge.reach(bend(i));
      const double slope = -leg.hinge.thigh * leg.hinge.shin * leg.hinge.share * std::sin(bend(i)) / reach / give_cm_;
      const double miss = (reach - leg.reach) / give_cm_;
      band[i][2] += slope * slope + 1 / (home_rad * home_rad);
      right[i] += slope * (slope * change_[i] - miss);
    }
    // Second differences that touch the run; beside it changes are 0.
    const auto frames = static_cast<std::ptrdiff_t>(wishes_.size());
    constexpr std::array<double, 3> second = {1, -2, 1};
    for (std::ptrdiff_t centre = -1; centre <= static_cast<std::ptrdiff_t>(count_); ++centre) {
      const std::ptrdiff_t frame = static_cast<std::ptrdiff_t>(first_) + centre;
      if (frame < 1 || frame + 1 >= frames) continue;
      for (int a = 0; a < 3; ++a) {
        const std::ptrdiff_t row = centre - 1 + a;
        if (row < 0 || row >= static_cast<std::ptrdiff_t>(count_)) continue;
        for (int b = 0; b <= a; ++b) {
          const std::ptrdiff_t column = centre - 1 + b;
          if (column >= 0)
            band[static_cast<std::size_t>(row)][static_cast<std::size_t>(2 - (a - b))] +=
                stiff_ * second[a] * second[b];
        }
      }
    }
    solve_band(band, right);
    change_ = std::move(right);
  }

  // No knee bends to the other side by more than it did.
  [[nodiscard]] double bend(std::size_t i) const {
    const double was = wishes_[first_ + i].hinge.bend;
    return std::max(std::min(was, 0.0), was + change_[i]);
  }

  const std::vector<LegWish>& wishes_;
  std::size_t first_, count_;
  double give_cm_, stiff_;
  std::vector<double> change_;
};

}  // namespace

std::vector<double> bends_for(const std::vector<LegWish>& wishes, double rate_hz, double give_cm) {
  std::vector<double> out;
  out.reserve(wishes.size());
  for (const LegWish& leg : wishes) out.push_back(leg.hinge.bend);
  for (std::size_t first = 0; first < wishes.size(); ++first) {
    if (!wishes[first].changes) continue;
    std::size_t last = first;
    while (last < wishes.size() && wishes[last].changes) ++last;
    Run(wishes, first, last, rate_hz, give_cm).solve(out);
    first = last;
  }
  return out;
}

}  // namespace kinespace
