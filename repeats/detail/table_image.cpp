#include "kinespace/repeats/detail/table_image.h"

#include <algorithm>
#include <cmath>

#include "kinespace/base/parallel.h"
#include "kinespace/base/png.h"

namespace kinespace {
namespace {

constexpr Colour gap_colour{255, 255, 255};

// Dark at zero, nearly white from the typical distance on; a little blue, so that marks stand out.
Colour grey(double distance, double typical) {
  const double t = std::clamp(distance / std::max(typical, 1e-9), 0.0, 1.0);
  const double level = 25 + 205 * std::sqrt(t);
  return {static_cast<std::uint8_t>(level), static_cast<std::uint8_t>(level),
          static_cast<std::uint8_t>(std::min(255.0, level + 12))};
}

}  // namespace

TableImage::TableImage(const SelfDistance& table, int size)
    : table_size_(table.size()),
      size_(table.size() >= 2 * size ? size : std::max(1, (size + table.size() / 2) / table.size()) * table.size()) {
  values_.resize(3 * static_cast<std::size_t>(size_) * static_cast<std::size_t>(size_));
  const auto pixel = [&](int at) {
    return std::min(table_size_ - 1, static_cast<int>((2 * std::int64_t{at} + 1) * table_size_ / (2 * size_)));
  };
  parallel_for(0, size_, [&](int y) {
    const int i = pixel(y);
    for (int x = 0; x < size_; ++x) {
      const int j = pixel(x);
      const bool gap = table.is_gap(i) || table.is_gap(j);
      set(x, y, gap ? gap_colour : grey(static_cast<double>(table.at(i, j)), table.typical()));
    }
  });
}

void TableImage::set(int x, int y, const Colour& colour) {
  if (x < 0 || y < 0 || x >= size_ || y >= size_) return;
  const std::size_t at =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(size_) + static_cast<std::size_t>(x));
  std::copy(colour.begin(), colour.end(), values_.begin() + static_cast<std::ptrdiff_t>(at));
}

void TableImage::mark(double i, double j, const Colour& colour, int width) {
  const int x = static_cast<int>(place(j + 0.5)), y = static_cast<int>(place(i + 0.5));
  for (int dy = -(width / 2); dy < width - width / 2; ++dy) {
    for (int dx = -(width / 2); dx < width - width / 2; ++dx) set(x + dx, y + dy, colour);
  }
}

std::string TableImage::png() const {
  return format_png(size_, size_, values_);
}

}  // namespace kinespace
