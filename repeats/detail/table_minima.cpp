#include "kinespace/repeats/detail/table_minima.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include <tbb/enumerable_thread_specific.h>

#include "kinespace/base/parallel.h"

namespace kinespace {
namespace {

constexpr int band_rows = 32;
constexpr int tile_columns = 512;

// A tile with a border of one pixel on every side, and what was found in it.
struct Workspace {
  SelfDistance::Tile tile{band_rows + 2, tile_columns + 2};
  std::array<std::uint8_t, tile_columns + 8> marks{};
};

constexpr std::uint8_t row_minimum = 1, column_minimum = 2;

struct Band {
  std::array<std::vector<TableMinima::Pixel>, band_rows> rows;
};

// Marks of `columns` pixels; every pointer has one more pixel before and after.
void mark_row(const float* above, const float* here, const float* below, int columns, float threshold,
              std::uint8_t* marks) {
  for (int c = 0; c < columns; ++c) {
    const float d = here[c];
    const int inside = static_cast<int>(d < threshold);
    const int along_row = static_cast<int>(d <= here[c - 1]) & static_cast<int>(d < here[c + 1]);
    const int along_column = static_cast<int>(d <= above[c]) & static_cast<int>(d < below[c]);
    marks[c] = static_cast<std::uint8_t>(inside * (along_row * row_minimum + along_column * column_minimum));
  }
}

void collect(const float* here, const std::uint8_t* marks, int columns, int first_column,
             std::vector<TableMinima::Pixel>& out) {
  for (int base = 0; base < columns; base += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, marks + base, 8);
    while (eight != 0) {
      const int c = base + std::countr_zero(eight) / 8;
      out.push_back({first_column + c, here[c], marks[c] == (row_minimum | column_minimum)});
      eight &= ~(std::uint64_t{0xFF} << (8 * (c - base)));
    }
  }
}

class MinimaFinder {
 public:
  MinimaFinder(const SelfDistance& table, double threshold, std::int64_t lag)
      : table_(table),
        threshold_(static_cast<float>(threshold * threshold)),
        first_column_(table.size(), table.size()) {
    int j = 0;
    for (int i = 0; i < table.size(); ++i) {
      if (table.is_gap(i)) continue;
      while (j < table.size() && (table.is_gap(j) || frame(j) < frame(i) + lag)) ++j;
      first_column_[static_cast<std::size_t>(i)] = j;
    }
  }

  void find(int row, Workspace& space, Band& band) const {
    const int rows = std::min(band_rows, table_.size() - row);
    int first = table_.size();
    for (int r = 0; r < rows; ++r) first = std::min(first, first_column_[static_cast<std::size_t>(row + r)]);
    for (int column = first; column < table_.size(); column += tile_columns) {
      find(row, rows, column, std::min(tile_columns, table_.size() - column), space, band);
    }
  }

 private:
  [[nodiscard]] std::int64_t frame(int pixel) const { return table_.frame(pixel, table_.run(pixel)); }

  void find(int row, int rows, int column, int columns, Workspace& space, Band& band) const {
    fill_tile(row, rows, column, columns, space.tile);
    for (int r = 0; r < rows; ++r) {
      const int from = std::max(first_column_[static_cast<std::size_t>(row + r)] - column, 0);
      if (from >= columns) continue;
      const float* here = &space.tile(r + 1, 1 + from);
      mark_row(&space.tile(r, 1 + from), here, &space.tile(r + 2, 1 + from), columns - from, threshold_,
               space.marks.data());
      std::fill_n(space.marks.begin() + (columns - from), 8, std::uint8_t{0});
      collect(here, space.marks.data(), columns - from, column + from, band.rows[static_cast<std::size_t>(r)]);
    }
  }

  // What lies outside the table is far.
  void fill_tile(int row, int rows, int column, int columns, SelfDistance::Tile& tile) const {
    constexpr float far = 1e30F;
    const int top = row > 0 ? 1 : 0, bottom = row + rows < table_.size() ? 1 : 0;
    const int left = column > 0 ? 1 : 0, right = column + columns < table_.size() ? 1 : 0;
    if (top == 0) tile.row(0).setConstant(far);
    if (bottom == 0) tile.row(rows + 1).setConstant(far);
    if (left == 0) tile.col(0).setConstant(far);
    if (right == 0) tile.col(columns + 1).setConstant(far);
    table_.tile(row - top, column - left, tile.block(1 - top, 1 - left, rows + top + bottom, columns + left + right));
  }

  const SelfDistance& table_;
  float threshold_;
  std::vector<int> first_column_;  // of each row: the first that is compared
};

}  // namespace

TableMinima find_minima(const SelfDistance& table, double threshold, std::int64_t lag) {
  const MinimaFinder finder(table, threshold, lag);
  std::vector<Band> bands(static_cast<std::size_t>((table.size() + band_rows - 1) / band_rows));
  tbb::enumerable_thread_specific<Workspace> workspaces;
  parallel_for(std::size_t{0}, bands.size(),
               [&](std::size_t b) { finder.find(static_cast<int>(b) * band_rows, workspaces.local(), bands[b]); });
  TableMinima out;
  out.row_begin.assign(1, 0);
  for (Band& band : bands) {
    for (auto& row : band.rows) {
      if (static_cast<int>(out.row_begin.size()) > table.size()) break;
      out.row_begin.push_back(out.row_begin.back() + row.size());
    }
  }
  out.pixels.reserve(out.row_begin.back());
  for (Band& band : bands) {
    for (auto& row : band.rows) {
      out.pixels.insert(out.pixels.end(), row.begin(), row.end());
      row = {};
    }
  }
  return out;
}

}  // namespace kinespace
