// Internal: what the hosts of the matrix_tile.cl kernels share.
#pragma once

#include <string>

#include "kinespace/kernels/detail/opencl.h"
#include "kinespace/kernels/matrix.h"

namespace kinespace::matrix_opencl {

// Columns are padded to a multiple of this, the wider of both shapes' tiles.
constexpr Eigen::Index kPadding = 64;
constexpr Eigen::Index kGroupSide = 16;

[[nodiscard]] inline Eigen::Index padded(Eigen::Index columns) {
  return (columns + kPadding - 1) / kPadding * kPadding;
}

[[nodiscard]] inline std::string options(bool lanes) {
  return lanes ? "-DWITH_LANES=1" : "-DWITH_LANES=0";
}

// The groups of a rows x columns product, as global and local sizes; `depth` of them behind each other.
struct Range {
  cl::NDRange global;
  cl::NDRange local;
};
[[nodiscard]] inline Range range(bool lanes, Eigen::Index rows, Eigen::Index columns, Eigen::Index depth = 1) {
  const Eigen::Index tile_rows = lanes ? 4 : 64;
  const Eigen::Index tile_columns = lanes ? 32 : 64;
  const auto groups_x = static_cast<std::size_t>((columns + tile_columns - 1) / tile_columns);
  const auto groups_y = static_cast<std::size_t>((rows + tile_rows - 1) / tile_rows);
  const auto side = static_cast<std::size_t>(lanes ? 1 : kGroupSide);
  return {cl::NDRange(groups_x * side, groups_y * side, static_cast<std::size_t>(depth)), cl::NDRange(side, side, 1)};
}

template <typename Derived>
[[nodiscard]] std::span<const float> numbers(const Eigen::PlainObjectBase<Derived>& values) {
  return {values.data(), static_cast<std::size_t>(values.size())};
}

// How many rows of `row_bytes` one buffer holds, at least one.
[[nodiscard]] inline Eigen::Index rows_at_a_time(const OpenClDevice& device, Eigen::Index row_bytes) {
  const auto most = std::min<std::uint64_t>(device.largest_buffer(), std::uint64_t{256} << 20);
  return std::max<Eigen::Index>(1, static_cast<Eigen::Index>(most) / std::max<Eigen::Index>(1, row_bytes));
}

}  // namespace kinespace::matrix_opencl
