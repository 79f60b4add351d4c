// Similar-posture paths: valleys of the self-distance table, along which one stretch of motion runs like another
// (lin2011 section 4.2.1, steps 1 to 7).
//
//   1.     Pixels above a threshold are dropped.
//   2.     Those that are minima along their row or their column are labelled, those along both are 2D minima.
//   3.     From a 2D minimum, the nearest first, the path of least cost over labelled pixels leads to the upper left
//          and to the lower right,
//   4. 5.  until every 2D minimum is on a path.
//   6.     A path goes on in another that begins within `bridge_s` to its lower right.
//   7.     Short paths go.
//
// Only i < j is looked at: the table is symmetric. Both indices of a path never fall along it, and each stays inside
// one run of the table.
#pragma once

#include <vector>

#include "kinespace/repeats/self_distance.h"

namespace kinespace {

struct PathOptions {
  double threshold = 0.3;  // > 0 to 2: dissimilar is a distance above this share of the table's typical distance
  double bridge_s = 0.3;   // 0 to 10: extent of the longest bridge along either axis
  double length_s = 0.6;   // 0.05 to 60: Manhattan length of the shortest path
  int crowd = 100;        // 1 to 100 000: of paths over frames that so many longer paths lead from already none is kept
  double lag_s = 0.2;     // > 0 to 60: frames nearer in time than this are not compared: neighbours are always alike
  void validate() const;  // throws Error{usage} naming field, value and range
};

struct PathPoint {
  int i = 0;
  int j = 0;  // > i
  float distance = 0;
  bool operator==(const PathPoint&) const = default;
};

struct PosturePath {
  std::vector<PathPoint> points;  // ascending; a step is at most two pixels, a bridge is filled in
};

// In the order of their first points. The same on every number of threads.
[[nodiscard]] std::vector<PosturePath> find_posture_paths(const SelfDistance& table, const PathOptions& options = {});

}  // namespace kinespace
