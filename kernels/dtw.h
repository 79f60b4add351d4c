// Batched dynamic time warping: the cheapest monotone matching of the frames of two clips, for many pairs at once.
//
//   D(i, j) = d(i, j) + min over the predecessors of the step pattern,   D(0, 0) = d(0, 0),   cost = D(n - 1, m - 1)
//
// d is the Euclidean distance of the two frames' feature rows, with which features that are weighted beforehand give
// the keyframe distance of yoo2019 (eq. 12). A cost is the plain sum of d over the cells of its path. With `squared`, d
// is the squared distance.
//
// Step patterns (sakoe 1978):
//
//   symmetric      from (i-1, j-1), (i, j-1) or (i-1, j)
//   slope_limited  P = 1: a straight step only after a diagonal one, so that slopes lie in [1/2, 2]; the first cell
//                  counts as reached diagonally. There is a legal path exactly when neither clip is longer than twice
//                  the other.
//
// Equal predecessors: the diagonal one is taken, then (i, j-1), then (i-1, j).
//
// Band: cells with |i (m-1) - j (n-1)| <= max(f (n-1)(m-1), n-1, m-1), that is a slanted band around the diagonal whose
// half width is the fraction f of the length (METHODS: 0.1 for retrieval), and never so thin that the diagonal is cut.
//
// The distances are computed as they are needed (never as a matrix product: identical frames have distance 0 exactly),
// in float; the sums are float on an OpenCL device, double on the processor: costs agree within 1e-5 relative plus
// rounding of the features. The result depends neither on threads nor on which pairs are asked for together.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kinespace/kernels/device.h"

namespace kinespace {

// The feature rows of many clips, one after another.
struct FeatureSet {
  int dims = 0;                            // features of a row, >= 1
  std::vector<float> values;               // [row][dims], finite
  std::vector<std::int64_t> starts = {0};  // clip c has the rows starts[c] .. starts[c + 1]

  [[nodiscard]] int clips() const { return static_cast<int>(starts.size()) - 1; }
  [[nodiscard]] int rows(int clip) const { return static_cast<int>(starts[clip + 1] - starts[clip]); }
  [[nodiscard]] std::span<const float> clip(int clip) const;
  // Adds a clip of rows.size() / dims rows.
  void add(std::span<const float> rows);
  // Throws Error{usage} naming what does not fit together.
  void validate() const;
};

enum class StepPattern { symmetric, slope_limited };

struct DtwOptions {
  StepPattern steps = StepPattern::symmetric;
  double band_fraction = 0;  // half width over length, [0, 1]; 0: no band
  bool squared = false;      // d is the squared distance
  bool want_path = false;
  std::uint64_t path_memory_bytes = std::uint64_t{256} << 20;  // for back-pointers at a time; more pairs take turns

  // Throws Error{usage} with field, value and range.
  void validate() const;
};

struct ClipPair {
  int query = 0;   // a clip of the first set
  int target = 0;  // a clip of the second set
  friend bool operator==(const ClipPair&, const ClipPair&) = default;
};

struct FramePair {
  int query = 0;
  int target = 0;
  friend bool operator==(const FramePair&, const FramePair&) = default;
};

struct DtwMatch {
  double cost = std::numeric_limits<double>::infinity();        // infinity: no legal path (an empty clip, slopes, band)
  double normalised = std::numeric_limits<double>::infinity();  // cost / (n + m)
  std::vector<FramePair> path;                                  // (0, 0) to (n-1, m-1) when asked for and found

  [[nodiscard]] bool found() const { return cost < std::numeric_limits<double>::infinity(); }
};

// Every unordered pair of different clips, i < j.
[[nodiscard]] std::vector<ClipPair> all_pairs(int clips);
// Every query with every target.
[[nodiscard]] std::vector<ClipPair> all_pairs(int queries, int targets);

// One match for each pair. Throws Error{usage} for sets, pairs or options that do not fit, Error{bad_input} for
// features that are not finite.
[[nodiscard]] std::vector<DtwMatch> dtw(const FeatureSet& queries, const FeatureSet& targets,
                                        std::span<const ClipPair> pairs, const DtwOptions& options,
                                        const Compute& compute = {});

namespace reference {
// The same, as a plain loop in double: what the kernels are tested and timed against.
[[nodiscard]] std::vector<DtwMatch> dtw(const FeatureSet& queries, const FeatureSet& targets,
                                        std::span<const ClipPair> pairs, const DtwOptions& options);
}  // namespace reference

}  // namespace kinespace
