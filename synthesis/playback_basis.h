// The functions of a motion space as tables for playback: their values at any time, and the integrals that the root's
// travel needs.
//
// Between two points of the space's grid a function is a cubic (motion/uniform_spline.h), so a value is four numbers and
// the place in the cell. Entry 0 is the mean function, entry k what row k - 1 of a sequence's scores belongs to: a function,
// or in a pinned space first 1 - s and s, between the ends. Each set of the space has tables of its own. The root's travel is the integral of
// the velocity v(s) over own time h(s), h'(s) = 1 + sum_j a_j cos(j pi s) (fpca/warp.h), which is linear in the
// functions and in the a_j:
//
//   integral_0^s v h' = sum_j a_j sum_k x_k integral_0^s phi_k(s) cos(j pi s) ds,   a_0 = x_0 = 1
//
// so the integrals are tabulated for j = 0 .. 5, as decode() takes them: of the samples, by spline. Floats: a space of
// 128 points and 32 functions takes 0.5 MB. One basis serves all clips of a space.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "kinespace/base/aligned.h"
#include "kinespace/fpca/left_out.h"
#include "kinespace/fpca/warp.h"

namespace kinespace {

class PlaybackBasis {
 public:
  static constexpr int lanes = 16;
  static constexpr int warp_terms = Warp::terms + 1;

  // Up to level of detail `levels` (all when < 0).
  explicit PlaybackBasis(const RegisteredSpace& space, int levels = -1);

  [[nodiscard]] int levels() const { return levels_; }
  // How slopes are corrected at cuts where the ends of sequences are kept; null where they are not.
  [[nodiscard]] const LeftOut* left_out() const { return left_out_ ? &*left_out_ : nullptr; }
  // Whether sequences of so many cycles can be played, and how: `set` below is that number.
  [[nodiscard]] bool has(int set) const {
    return set >= 0 && set < static_cast<int>(sets_.size()) && of(set).points > 0;
  }
  [[nodiscard]] int points(int set) const { return of(set).points; }
  // Entries behind the mean: in all, and at a level of detail.
  [[nodiscard]] int rows(int set) const { return of(set).rows; }
  [[nodiscard]] int rows_at(int set, int level) const { return of(set).rows_at[static_cast<std::size_t>(level)]; }
  [[nodiscard]] int curves() const { return static_cast<int>(group_of_.size()); }
  [[nodiscard]] int group_of(int curve) const { return group_of_[static_cast<std::size_t>(curve)]; }
  // Whether the same components of all joints share functions, as they do in the two coarser groupings.
  [[nodiscard]] bool by_component() const { return by_component_; }
  // Entries, mean first, stand in blocks of `lanes`; those beyond rows() are 0. The leading block of all cells is in one
  // piece, so that poses of few functions need little of the cache.
  [[nodiscard]] int blocks(int set) const { return of(set).blocks; }
  [[nodiscard]] int padded(int set) const { return blocks(set) * lanes; }

  // Coefficients of 1, b, b^2, b^3, `lanes` floats each, of a block of a group between points i and i + 1.
  [[nodiscard]] const float* values(int set, int group, int block, int cell) const {
    return of(set).values.data() + of(set).at(static_cast<std::size_t>(group), block, cell) * cubic;
  }
  // From one block to the next.
  [[nodiscard]] std::ptrdiff_t values_stride(int set) const {
    return static_cast<std::ptrdiff_t>(of(set).cells() * cubic);
  }
  // The same of the integrals of the group that curve 0 .. 2 belongs to: warp_terms times four.
  [[nodiscard]] const float* integrals(int set, int axis, int block, int cell) const {
    return of(set).integrals.data() + of(set).at(slot(axis), block, cell) * cubic * warp_terms;
  }
  [[nodiscard]] std::ptrdiff_t integrals_stride(int set) const { return values_stride(set) * warp_terms; }
  // Integrals over all of [0, 1]: [warp term][lane], block after block.
  [[nodiscard]] const float* ends(int set, int axis, int block) const {
    return of(set).ends.data() +
           (slot(axis) * static_cast<std::size_t>(blocks(set)) + static_cast<std::size_t>(block)) * warp_terms * lanes;
  }

 private:
  static constexpr std::size_t cubic = 4 * lanes;
  struct Set {
    int points = 0;
    int rows = 0;
    int blocks = 0;
    std::vector<int> rows_at;  // by level
    AlignedVector<float> values;
    AlignedVector<float> integrals;
    AlignedVector<float> ends;

    [[nodiscard]] std::size_t cells() const { return static_cast<std::size_t>(points) - 1; }
    [[nodiscard]] std::size_t at(std::size_t table, int block, int cell) const {
      return (table * static_cast<std::size_t>(blocks) + static_cast<std::size_t>(block)) * cells() +
             static_cast<std::size_t>(cell);
    }
  };
  [[nodiscard]] const Set& of(int set) const { return sets_[static_cast<std::size_t>(set)]; }
  [[nodiscard]] Set tables_of(const MotionSpace& space) const;
  [[nodiscard]] std::size_t slot(int axis) const { return one_velocity_group_ ? 0 : static_cast<std::size_t>(axis); }

  int levels_ = 0;
  std::optional<LeftOut> left_out_;
  bool by_component_ = false;
  bool one_velocity_group_ = false;
  std::vector<int> group_of_;
  std::vector<Set> sets_;
};

}  // namespace kinespace
