// Which paths lead from an interval of a self-distance table to where. Private to this folder.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "kinespace/repeats/posture_paths.h"

namespace kinespace {

// A path seen from one side: `from` is the axis of the primary clip, `to` the axis of the repeated one.
struct PathSide {
  std::span<const PathPoint> points;
  bool swapped = false;  // from is j, to is i

  [[nodiscard]] int from(std::size_t p) const { return swapped ? points[p].j : points[p].i; }
  [[nodiscard]] int to(std::size_t p) const { return swapped ? points[p].i : points[p].j; }
  [[nodiscard]] std::size_t size() const { return points.size(); }
  // The points with from() in [first, last).
  [[nodiscard]] PathSide part_from(int first, int last) const;
  // The points with to() in [first, last).
  [[nodiscard]] PathSide part_to(int first, int last) const;
};

class PathIndex {
 public:
  PathIndex(std::span<const PosturePath> paths, int pixels);

  // Calls visit(side) with the part of every path over [first, last), each side of each path at most once, in a fixed
  // order.
  template <class Visit>
  void visit(int first, int last, const Visit& visit) const {
    for (std::size_t b = bucket(first); b <= bucket(last - 1); ++b) {
      for (std::size_t e = begin_[b]; e < begin_[b + 1]; ++e) {
        const Entry& entry = entries_[e];
        if (b != std::max(bucket(first), bucket(entry.first)) || entry.first >= last || entry.last < first) continue;
        const PathSide part = side(entry).part_from(first, last);
        if (part.size() > 0) visit(part);
      }
    }
  }

 private:
  struct Entry {
    std::uint32_t path = 0;
    bool swapped = false;
    int first = 0;  // on the axis it is seen from
    int last = 0;   // included
  };
  static constexpr int bucket_pixels = 16;
  [[nodiscard]] static std::size_t bucket(int pixel) { return static_cast<std::size_t>(pixel / bucket_pixels); }
  [[nodiscard]] PathSide side(const Entry& entry) const { return {paths_[entry.path].points, entry.swapped}; }

  std::span<const PosturePath> paths_;
  std::vector<std::size_t> begin_;  // of each bucket, into entries
  std::vector<Entry> entries_;
};

}  // namespace kinespace
