#include "kinespace/mesh/mesh_sequence.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

[[noreturn]] void fail(const std::string& source, std::string found, std::string expected) {
  throw Error(ErrorKind::bad_input, {.file = source, .found = std::move(found), .expected = std::move(expected)});
}

void require_finite(const MeshSequence& mesh, const std::string& source) {
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const double x = static_cast<double>(mesh.positions[i]);
    if (std::abs(x) <= largest_coordinate) continue;  // false for what is not a number
    const std::size_t vertex = i / 3;
    fail(source,
         fmt::format("coordinate {} of vertex {} in frame {} is {}", "xyz"[i % 3],
                     vertex % static_cast<std::size_t>(mesh.vertices), vertex / static_cast<std::size_t>(mesh.vertices),
                     x),
         fmt::format("a finite number of at most {}", largest_coordinate));
  }
}

}  // namespace

Points frame_points(const MeshSequence& mesh, int frame) {
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(mesh.frame(frame).data(), mesh.vertices, 3).cast<double>();
}

void set_frame(MeshSequence& mesh, int frame, const Points& points) {
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
  Eigen::Map<RowMajor>(mesh.frame(frame).data(), mesh.vertices, 3) = points.cast<float>();
}

double diagonal(const MeshSequence& mesh) {
  std::array<float, 3> low{}, high{};
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const float x = mesh.positions[i];
    low[i % 3] = i < 3 ? x : std::min(low[i % 3], x);
    high[i % 3] = i < 3 ? x : std::max(high[i % 3], x);
  }
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double side = static_cast<double>(high[c]) - static_cast<double>(low[c]);
    sum += side * side;
  }
  return std::sqrt(sum);
}

void require_valid(const MeshSequence& mesh, const std::string& source) {
  if (!(mesh.rate_hz > 0 && std::isfinite(mesh.rate_hz))) {
    fail(source, fmt::format("{} frames a second", mesh.rate_hz), "a positive rate");
  }
  if (mesh.vertices < 1 || mesh.vertices > most_vertices) {
    fail(source, fmt::format("{} vertices", mesh.vertices), fmt::format("1 to {}", most_vertices));
  }
  if (mesh.frames < 1) fail(source, fmt::format("{} frames", mesh.frames), "at least one");
  if (mesh.positions.size() != mesh.frame_size() * static_cast<std::size_t>(mesh.frames)) {
    fail(source, fmt::format("{} coordinates", mesh.positions.size()),
         fmt::format("3 for each of {} vertices in {} frames", mesh.vertices, mesh.frames));
  }
  require_finite(mesh, source);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::int32_t v : mesh.triangles[t]) {
      if (v >= 0 && v < mesh.vertices) continue;
      fail(source, fmt::format("triangle {} has vertex {}", t, v), fmt::format("0 to {}", mesh.vertices - 1));
    }
  }
}

}  // namespace kinespace
