// What every stream of a mesh sequence says first: name, rate and counts; and grids of whole numbers for positions.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/mesh/mesh_sequence.h"
#include "kinespace/mesh_codecs/key_mesh.h"
#include "kinespace/storage/bitstream.h"
#include "kinespace/storage/varint.h"

namespace kinespace {

struct MeshLayout {
  std::string name;
  double rate_hz = MeshSequence::usual_rate_hz;
  int vertices = 0;
  int frames = 0;
  std::int64_t triangles = 0;
};
[[nodiscard]] MeshLayout layout_of(const MeshSequence& mesh);
void put_layout(ByteWriter& out, const MeshLayout& layout);
// Throws Error{bad_input} for what get_layout takes from no stream.
void require_encodable(const MeshSequence& mesh);
// Counts are checked against the stream's size: a vertex, triangle or frame costs memory. Throws Error{bad_input}.
[[nodiscard]] MeshLayout get_layout(ByteReader& in, std::uint64_t stream_bytes);
// A sequence of that layout without positions.
[[nodiscard]] MeshSequence empty_sequence(const MeshLayout& layout, std::vector<Triangle> triangles);

// How many numbers a stream of so many bytes may stand for in memory, in any one table.
[[nodiscard]] std::int64_t most_mesh_numbers(std::uint64_t stream_bytes);

// The finished stream; made longer with zeros where a reader would not believe so few bytes so many vertices, triangles
// and positions (get_layout), or the `numbers` of its tables (most_mesh_numbers). Throws Error{bad_input} for more
// numbers than a reader takes, however long the stream.
[[nodiscard]] Bytes finish_mesh_stream(BitstreamWriter out, const MeshLayout& layout, std::int64_t numbers = 0);

// x = origin + step * q.
struct Grid {
  std::array<double, 3> origin{};
  double step = 1;

  [[nodiscard]] Points points(std::span<const GridPoint> q) const;
  // Throws Error{usage} when the grid is too fine for the points.
  [[nodiscard]] std::vector<GridPoint> quantised(const Points& x) const;
};
// A grid whose origin is the lowest corner of the points.
[[nodiscard]] Grid grid_for(const Points& x, double step);
void put_grid(ByteWriter& out, const Grid& grid);
[[nodiscard]] Grid get_grid(ByteReader& in);
// A finite number of at least `least` and at most `most`.
[[nodiscard]] double get_number(ByteReader& in, double least, double most);

}  // namespace kinespace
