#include "kinespace/fpca/registered_space.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace kinespace {

RegisteredSpace::RegisteredSpace(MotionSpace plain) {
  sets_.push_back(std::move(plain));
}

RegisteredSpace::RegisteredSpace(std::vector<MotionSpace> sets) : sets_(std::move(sets)) {
  assert(!sets_.empty());
}

bool RegisteredSpace::has(int cycles) const {
  if (cycles == 0) return true;
  if (cycles < 0 || cycles >= static_cast<int>(sets_.size())) return false;
  const std::vector<CurveMoments>& moments = sets_[static_cast<std::size_t>(cycles)].moments();
  return !moments.empty() && moments.front().count() > 0;
}

const MotionSpace& RegisteredSpace::of(int cycles) const {
  assert(has(cycles));
  return sets_[static_cast<std::size_t>(cycles)];
}

int RegisteredSpace::levels() const {
  int most = 0;
  for (std::size_t cycles = 0; cycles < sets_.size(); ++cycles) {
    if (has(static_cast<int>(cycles))) most = std::max(most, sets_[cycles].levels());
  }
  return most;
}

int RegisteredSpace::functions() const {
  int most = 0;
  for (const MotionSpace& set : sets_) most = std::max(most, set.functions());
  return most;
}

int RegisteredSpace::function_count() const {
  int sum = 0;
  for (const MotionSpace& set : sets_) sum += set.function_count();
  return sum;
}

// Weighted by how much motion each set was made of.
template <typename Covered>
double RegisteredSpace::mean_by_curves(const Covered& covered) const {
  double sum = 0;
  double curves = 0;
  for (const MotionSpace& set : sets_) {
    for (const CurveMoments& moments : set.moments()) {
      const auto count = static_cast<double>(moments.count()) * std::max(1, set.options().cycles);
      sum += count * covered(set);
      curves += count;
    }
  }
  return curves > 0 ? sum / curves : covered(plain());
}

double RegisteredSpace::variance_covered() const {
  return mean_by_curves([](const MotionSpace& set) { return set.variance_covered(); });
}

double RegisteredSpace::movement_covered() const {
  return mean_by_curves([](const MotionSpace& set) { return set.movement_covered(); });
}

}  // namespace kinespace
