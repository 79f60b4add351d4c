// The k nearest of many float vectors, exactly: the list is that of comparing with every one of them.
//
// A vector x is a row; the squared distance is the sum of w_d^2 (x_d - q_d)^2 over the dimensions, in double, in the
// order that squared_distance_exact defines. Nearest first, equal distances by the lower row.
//
// How it is fast without losing any. At the build the rows are turned onto their principal axes, so that the leading
// coordinates hold most of a distance (a turn keeps distances; data that come in order of importance, as motion vectors
// do, need none). Similar rows are gathered in blocks of 16. Then, for a query, each of these bounds from below what a
// distance can be:
//
//   of a block     to the box around its rows in the first 24 coordinates, and, for the rest, the difference of the
//                  norms of what is left out: |x_rest - q_rest| >= ||x_rest| - |q_rest||
//   of a row       the sum over its first 16, 32, 64, ... coordinates, and the same difference for those that follow
//
// Blocks are visited from the least bound on, until that of the next is farther than the k-th found. Bounds are taken
// in float and widened by more than their rounding; rows that pass are compared again in double, as they were given.
//
// The index keeps one or two floats per number of the data. Queries from several threads are safe, each with a scratch
// of its own. Results do not depend on threads or on the processor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "kinespace/base/aligned.h"
#include "kinespace/kernels/matrix.h"

namespace kinespace {

inline constexpr int vector_lanes = 16;  // rows of a block, and blocks of a group of boxes

struct Neighbour {
  std::int64_t row = 0;
  double squared = 0;  // distance
  friend bool operator==(const Neighbour&, const Neighbour&) = default;
};

struct VectorSearchOptions {
  // Turn the rows onto their principal axes: d^3 time at the build and the rows kept twice. Off for data whose leading
  // dimensions have most of the variance already.
  bool rotate = true;
  // One weight w_d in [0, 1000] for each dimension; empty: all 1. An index is of one weighting.
  std::vector<float> weights = {};
};

class VectorSearch {
 public:
  // What a query needs to work on; kept from query to query, nothing is allocated after the first.
  struct Scratch {
    std::vector<double> centred;
    std::vector<float> query;                     // weighted
    std::vector<float> turned;                    // and turned
    std::vector<float> rest;                      // norms of what follows each level
    std::vector<float> bounds;                    // of each block
    std::vector<std::pair<float, int>> order;     // blocks by their bound
    std::vector<std::pair<double, int>> nearest;  // heap
    std::vector<Neighbour> result;
  };

  // One vector a row. Throws Error{usage} for no dimensions, more than 2^30 rows, or weights that do not fit, and
  // Error{bad_input} naming the first row that has a number beyond 1e12 or none at all.
  explicit VectorSearch(RowMatrix<float> rows, const VectorSearchOptions& options = {});

  [[nodiscard]] std::int64_t size() const { return size_; }
  [[nodiscard]] int dimensions() const { return dimensions_; }

  // The k nearest rows, fewer when there are not so many. `allowed`: empty, or a byte for each row, 0 for rows that are
  // left out. Throws Error{usage} for k < 1 or sizes that do not fit, Error{bad_input} for a query that is not finite.
  [[nodiscard]] std::vector<Neighbour> nearest(std::span<const float> query, int k,
                                               std::span<const std::uint8_t> allowed = {}) const;
  // The same, in the scratch.
  std::span<const Neighbour> nearest(std::span<const float> query, int k, Scratch& scratch,
                                     std::span<const std::uint8_t> allowed = {}) const;

 private:
  struct Found;
  void check(std::span<const float> query, int k, std::span<const std::uint8_t> allowed) const;
  void turn_rows(RowMatrix<float>& rows);
  void gather(const RowMatrix<float>& rows);
  void turn_query(std::span<const float> query, Scratch& scratch) const;
  void bound_blocks(Scratch& scratch, std::span<const std::uint8_t> allowed) const;
  void visit(int block, const Scratch& scratch, std::span<const std::uint8_t> allowed, Found& found) const;
  [[nodiscard]] double exact(int block, int lane, const Scratch& scratch) const;

  std::int64_t size_ = 0;
  int dimensions_ = 0;
  int boxed_ = 0;  // leading dimensions of a box
  int blocks_ = 0;
  std::vector<float> weights_;
  Eigen::VectorXd mean_;           // empty when not turned
  RowMatrix<double> axes_;         // [dimension][axis]
  RowMatrix<float> rows_;          // weighted, by row; empty when not turned
  std::vector<int> levels_;        // numbers of coordinates after which a row's bound is looked at; the last: all
  std::vector<std::int32_t> ids_;  // [block][lane]; -1: no row
  AlignedVector<float> values_;    // [block][coordinate][lane]
  AlignedVector<float> rests_;     // [block][level][lane]
  AlignedVector<float> boxes_;     // [16 blocks][low, high of each boxed dimension, then of the rest][block]
};

// The sum of (a_d - b_d)^2 in double: eight sums over d = i mod 8, added as ((0 + 4) + (2 + 6)) + ((1 + 5) + (3 + 7)).
[[nodiscard]] double squared_distance_exact(std::span<const float> a, std::span<const float> b);

namespace reference {
// Compares with every row.
[[nodiscard]] std::vector<Neighbour> nearest(const RowMatrixView<float>& rows, std::span<const float> query, int k,
                                             std::span<const float> weights = {},
                                             std::span<const std::uint8_t> allowed = {});
}  // namespace reference

}  // namespace kinespace
