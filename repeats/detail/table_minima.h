// The labelled pixels of a self-distance table (lin2011 section 4.2.1, steps 1 and 2). Private to this folder.
//
// A pixel below the threshold is labelled when it is a minimum along its row or its column; along both it is a 2D
// minimum. Of equal neighbours the last counts. Rows i, columns j with frame(j) - frame(i) >= lag.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kinespace/repeats/self_distance.h"

namespace kinespace {

struct TableMinima {
  struct Pixel {
    int column = 0;
    float square = 0;  // of the distance
    bool both = false;
  };
  std::vector<std::size_t> row_begin;  // size() + 1 of them, into pixels
  std::vector<Pixel> pixels;           // by row, then by column

  [[nodiscard]] std::span<const Pixel> row(int i) const {
    const auto r = static_cast<std::size_t>(i);
    return std::span(pixels).subspan(row_begin[r], row_begin[r + 1] - row_begin[r]);
  }
};

// `threshold` in units of the table, `lag` in frames. The table is gone through in tiles, in parallel; the result is
// the same on every number of threads.
[[nodiscard]] TableMinima find_minima(const SelfDistance& table, double threshold, std::int64_t lag);

}  // namespace kinespace
