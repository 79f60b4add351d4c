// Which intervals may become primary clips, and what a repeated one refers to. Private to this folder.
#pragma once

#include <span>
#include <vector>

#include "kinespace/repeats/detail/path_index.h"
#include "kinespace/repeats/posture_paths.h"

namespace kinespace {

struct PixelInterval {
  int first = 0;
  int last = 0;  // exclusive
};

// The ends of all paths on both axes are cuts; of cuts nearer than `shortest` pixels those that most ends fall on stay,
// and where cuts are further apart than half of `longest` more are set. The intervals between two cuts of one run, from
// `shortest` to `longest` pixels, in time.
[[nodiscard]] std::vector<PixelInterval> candidate_intervals(const SelfDistance& table,
                                                             std::span<const PosturePath> paths, int shortest,
                                                             int longest);

// The `from` of a path for each pixel first .. last - 1 of its other axis: where several points share a pixel the
// nearest posture, in between on the line, at the ends on at the pace of one to one; never falling, inside [least, most
// - 1].
[[nodiscard]] std::vector<float> references(const PathSide& part, int first, int last, int least, int most);

}  // namespace kinespace
