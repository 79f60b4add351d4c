// A self-distance table as an image, with paths drawn in it. Private to this folder.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "kinespace/repeats/self_distance.h"

namespace kinespace {

using Colour = std::array<std::uint8_t, 3>;

// A square image of the whole table.
class TableImage {
 public:
  // The size is about `size`: a whole number of pixels for each of a table that is smaller than twice that. Dark: like
  // postures; white: gaps.
  TableImage(const SelfDistance& table, int size);

  [[nodiscard]] int size() const { return size_; }
  // Where a pixel of the table begins.
  [[nodiscard]] double place(double pixel) const { return pixel * size_ / table_size_; }
  // Colours the place of a pixel of the table, j to the right and i down, `width` pixels wide.
  void mark(double i, double j, const Colour& colour, int width);

  // As PNG. Throws Error{machine} when that fails.
  [[nodiscard]] std::string png() const;

 private:
  void set(int x, int y, const Colour& colour);

  int table_size_;
  int size_;
  std::vector<std::uint8_t> values_;  // red, green, blue, row by row from the top
};

}  // namespace kinespace
