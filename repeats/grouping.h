// Segments of like behaviour, wherever they stand, as groups: a normalised cut (Shi and Malik 2000) with the affinity
// of lin2011, equation 1.
//
//   affinity(i, j) = alpha * sum_p w(p) |PC_p(i) . PC_p(j)| + (1 - alpha) * MP(i) . MP(j), negative ones counted as 0
//
// PC_p: the p-th principal component of a segment; its sign means nothing, hence the absolute value. w(p) = 2^-p,
// normalised to a sum of one (the paper says "decreasing"). MP: the segment's mean posture less the mean posture of the
// table, normalised (with the body's own shape left in, all postures would be alike). The paper calls it a distance; it
// is large where segments are alike.
//
// The number of groups, which the paper leaves open, is the one that is expected to cost least (group_cost): more
// groups want fewer axes each, but each brings axes of its own. Deterministic.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kinespace/repeats/frame_table.h"

namespace kinespace {

struct GroupingOptions {
  double alpha = 0.6;           // 0 to 1: of components against mean postures
  int components = 5;           // 1 to 20: K, principal components compared
  int max_groups = 12;          // 1 to 64
  double variance = 0.95;       // 0.5 to 0.9999: what the groups' spaces shall keep of the variance of all frames
  double coefficient_rate = 4;  // > 0: coefficients coded per second and axis } for the expected
  double axis_weight = 2;       // > 0: what one number of an axis costs, in coefficients } cost
  int refinements = 4;    // 0 to 100: rounds in which every segment moves to the group whose space leaves the least
                          // of it unexplained; 0: the paper's groups
  void validate() const;  // throws Error{usage} naming field, value and range
};

struct SegmentGrouping {
  std::vector<FrameSpan> segments;  // in time, as given
  std::vector<int> group;           // of each segment; groups are numbered in the order of their first segments
  int groups = 0;

  // The frames of group `wanted`: neighbouring segments of the same clip are joined.
  [[nodiscard]] std::vector<FrameSpan> ranges(int wanted, const FrameTable& table) const;
};

// Groups the segments (in time, covering the table).
[[nodiscard]] SegmentGrouping group_segments(const FrameTable& table, std::span<const FrameSpan> segments,
                                             const GroupingOptions& options = {});

}  // namespace kinespace
