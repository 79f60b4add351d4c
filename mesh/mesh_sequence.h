// An animated mesh: triangles that stay, vertices that move.
//
// Positions are 32-bit floats, as the files have them, in the file's own unit: every measure of mesh/ is relative to
// the mesh's size or stated in that unit. Frame f, vertex v has its three coordinates at positions[3 * (f * vertices +
// v)]. Vertices that belong to no triangle and triangles that a geometer would not like are allowed (mesh/mesh_report.h
// counts them); indices out of range and coordinates that are not finite are not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace kinespace {

using Triangle = std::array<std::int32_t, 3>;
// Whether a vertex stands in it twice.
[[nodiscard]] inline bool degenerate(const Triangle& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

// One frame as a matrix, a row a vertex; stored by columns, so that x, y and z are right-hand sides of linear systems.
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3>;

struct MeshSequence {
  static constexpr double usual_rate_hz = 30;  // taken where a file does not tell (OBJ, PLY, NumPy)

  std::string name;
  double rate_hz = usual_rate_hz;  // > 0
  int vertices = 0;                // >= 1
  int frames = 0;                  // >= 1
  std::vector<float> positions;
  std::vector<Triangle> triangles;

  // The 3 * vertices numbers of one frame.
  [[nodiscard]] std::span<const float> frame(int f) const {
    return std::span(positions).subspan(static_cast<std::size_t>(f) * frame_size(), frame_size());
  }
  [[nodiscard]] std::span<float> frame(int f) {
    return std::span(positions).subspan(static_cast<std::size_t>(f) * frame_size(), frame_size());
  }
  [[nodiscard]] std::size_t frame_size() const { return static_cast<std::size_t>(vertices) * 3; }
};

// One frame in double precision, and back (rounded to floats; `points` must have a row for each vertex).
[[nodiscard]] Points frame_points(const MeshSequence& mesh, int frame);
void set_frame(MeshSequence& mesh, int frame, const Points& points);

// The diagonal of the box around all frames together: what "relative to the size" means.
[[nodiscard]] double diagonal(const MeshSequence& mesh);

// No coordinate of a mesh is larger; what is, is damage. Keeps every later square and sum finite.
inline constexpr double largest_coordinate = 1e12;
// More would not fit the 32-bit indices of positions that files use.
inline constexpr std::int64_t most_vertices = 100'000'000;

// Throws Error{bad_input} naming `source`, frame and vertex or triangle when something of the above does not hold: a
// rate that is not positive, no vertex, no frame, a number of positions that is not 3 * vertices * frames, a coordinate
// that is not finite or beyond `largest_coordinate`, a triangle with an index out of range.
void require_valid(const MeshSequence& mesh, const std::string& source);

}  // namespace kinespace
