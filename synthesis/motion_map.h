// The clips of a library as points of a plane, for people to look at: clips that move alike lie together.
//
// The plane is that of the two principal axes of the clips' vectors (fpca/clip_space.h), the projection in which the
// points are as far apart as they can be; by how much less than in all dimensions, `shares` says. Distances in the plane
// are never larger than those that a query without DTW orders by (synthesis/retrieval.h).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kinespace/storage/library_rows.h"

namespace kinespace {

struct MapPoint {
  std::int64_t clip_id = 0;
  double x = 0;  // along the first axis, from the mean of all clips; units of the vectors
  double y = 0;
};

struct MotionMap {
  std::vector<MapPoint> points;    // in the order of the matrix
  std::array<double, 2> shares{};  // of the variance of the vectors, along each axis; 0 where there is none
};

// Signs are chosen such that the entry of an axis that is largest in magnitude is positive, so the same library gives
// the same picture everywhere. Time and memory grow with the smaller of clips and dimensions: 10 000 clips of 1456
// numbers take seconds.
[[nodiscard]] MotionMap motion_map(const RetrievalMatrix& vectors);

}  // namespace kinespace
