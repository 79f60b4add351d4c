#include "kinespace/mesh_codecs/mesh_layout.h"

#include <algorithm>
#include <cmath>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

constexpr double most_steps = 1 << 28;
// What is believed of a stream however small, and for each of its bytes: numbers of a table, positions of all frames.
constexpr std::int64_t free_numbers = std::int64_t{1} << 21;
constexpr std::int64_t free_positions = std::int64_t{1} << 24;
constexpr std::int64_t numbers_a_byte = 1024;
constexpr std::uint64_t most_counted_bytes = std::uint64_t{1} << 20;  // longer streams get no more numbers
constexpr std::int64_t free_vertices = 65536, vertices_a_byte = 64;
constexpr std::int64_t free_triangles = 131072, triangles_a_byte = 128;
constexpr int most_frames = 1 << 20;
constexpr double least_rate = 1e-9, most_rate = 1e12;  // Hz

// Bytes that make `wanted` things believable.
std::int64_t bytes_for(std::int64_t wanted, std::int64_t free, std::int64_t a_byte) {
  return wanted <= free ? 0 : (wanted - free + a_byte - 1) / a_byte;
}

std::int64_t get_limited(ByteReader& in, std::int64_t least, std::int64_t most, const char* what) {
  const std::uint64_t value = get_varint(in);
  if (value < static_cast<std::uint64_t>(least) || value > static_cast<std::uint64_t>(most)) {
    in.fail(std::to_string(value) + " " + what, std::to_string(least) + " to " + std::to_string(most) + " (damaged)");
  }
  return static_cast<std::int64_t>(value);
}

}  // namespace

std::int64_t most_mesh_numbers(std::uint64_t stream_bytes) {
  return free_numbers + numbers_a_byte * static_cast<std::int64_t>(std::min(stream_bytes, most_counted_bytes));
}

Bytes finish_mesh_stream(BitstreamWriter out, const MeshLayout& layout, std::int64_t numbers) {
  if (numbers > most_mesh_numbers(most_counted_bytes)) {
    throw Error(ErrorKind::bad_input,
                {.file = layout.name,
                 .found = std::to_string(layout.vertices) + " vertices in " + std::to_string(layout.frames) + " frames",
                 .expected = "what one stream can hold at this precision",
                 .remedy = "ask for less precision or fewer bases, or encode it in parts"});
  }
  Bytes bytes = out.finish();
  const std::int64_t positions = std::int64_t{layout.vertices} * layout.frames;
  const std::int64_t needed = std::max({bytes_for(layout.vertices, free_vertices, vertices_a_byte),
                                        bytes_for(layout.triangles, free_triangles, triangles_a_byte),
                                        bytes_for(positions, free_positions, numbers_a_byte),
                                        bytes_for(numbers, free_numbers, numbers_a_byte)});
  const std::int64_t missing = needed - static_cast<std::int64_t>(bytes.size());
  if (missing <= 0) return bytes;
  out.add_section("padding", Bytes(static_cast<std::size_t>(missing), std::byte{0}));
  return out.finish();
}

MeshLayout layout_of(const MeshSequence& mesh) {
  return {.name = mesh.name,
          .rate_hz = mesh.rate_hz,
          .vertices = mesh.vertices,
          .frames = mesh.frames,
          .triangles = static_cast<std::int64_t>(mesh.triangles.size())};
}

void put_layout(ByteWriter& out, const MeshLayout& layout) {
  put_short_string(out, layout.name);
  out.put(layout.rate_hz);
  put_varint(out, static_cast<std::uint64_t>(layout.vertices));
  put_varint(out, static_cast<std::uint64_t>(layout.frames));
  put_varint(out, static_cast<std::uint64_t>(layout.triangles));
}

void require_encodable(const MeshSequence& mesh) {
  if (mesh.frames > most_frames) {
    throw Error(ErrorKind::bad_input, {.file = mesh.name,
                                       .found = std::to_string(mesh.frames) + " frames",
                                       .expected = "at most " + std::to_string(most_frames),
                                       .remedy = "encode it in parts"});
  }
  if (!(mesh.rate_hz >= least_rate && mesh.rate_hz <= most_rate)) {
    throw Error(ErrorKind::bad_input, {.file = mesh.name,
                                       .found = std::to_string(mesh.rate_hz) + " frames a second",
                                       .expected = "1e-9 to 1e12",
                                       .remedy = "give the rate (--rate)"});
  }
}

MeshLayout get_layout(ByteReader& in, std::uint64_t stream_bytes) {
  const auto bytes = static_cast<std::int64_t>(std::min<std::uint64_t>(stream_bytes, std::uint64_t{1} << 40));
  MeshLayout out;
  out.name = get_short_string(in);
  out.rate_hz = get_number(in, least_rate, most_rate);
  out.vertices = static_cast<int>(
      get_limited(in, 1, std::min(most_vertices, free_vertices + vertices_a_byte * bytes), "vertices"));
  out.frames = static_cast<int>(get_limited(in, 1, most_frames, "frames"));
  out.triangles = get_limited(in, 0, free_triangles + triangles_a_byte * bytes, "triangles");
  if (std::int64_t{out.vertices} * out.frames > free_positions + numbers_a_byte * bytes) {
    in.fail(std::to_string(out.vertices) + " vertices in " + std::to_string(out.frames) + " frames", "fewer (damaged)");
  }
  return out;
}

MeshSequence empty_sequence(const MeshLayout& layout, std::vector<Triangle> triangles) {
  MeshSequence out;
  out.name = layout.name;
  out.rate_hz = layout.rate_hz;
  out.vertices = layout.vertices;
  out.frames = layout.frames;
  out.triangles = std::move(triangles);
  return out;
}

Points Grid::points(std::span<const GridPoint> q) const {
  Points out(static_cast<Eigen::Index>(q.size()), 3);
  for (std::size_t v = 0; v < q.size(); ++v) {
    for (std::size_t d = 0; d < 3; ++d) {
      out(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(d)) = origin[d] + step * static_cast<double>(q[v][d]);
    }
  }
  return out;
}

std::vector<GridPoint> Grid::quantised(const Points& x) const {
  std::vector<GridPoint> out(static_cast<std::size_t>(x.rows()));
  for (std::size_t v = 0; v < out.size(); ++v) {
    for (std::size_t d = 0; d < 3; ++d) {
      const double at = (x(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(d)) - origin[d]) / step;
      if (!(std::abs(at) < most_steps)) {
        throw Error(ErrorKind::usage, {.found = "an error so small that positions need more than 28 bits",
                                       .expected = "what 32-bit floats can hold",
                                       .remedy = "ask for less precision"});
      }
      out[v][d] = static_cast<std::int32_t>(std::lround(at));
    }
  }
  return out;
}

Grid grid_for(const Points& x, double step) {
  Grid out;
  out.step = step;
  for (std::size_t d = 0; d < 3; ++d) {
    double least = x(0, static_cast<Eigen::Index>(d));
    for (Eigen::Index v = 1; v < x.rows(); ++v) least = std::min(least, x(v, static_cast<Eigen::Index>(d)));
    out.origin[d] = least;
  }
  return out;
}

void put_grid(ByteWriter& out, const Grid& grid) {
  for (const double x : grid.origin) out.put(x);
  out.put(grid.step);
}

Grid get_grid(ByteReader& in) {
  Grid out;
  for (double& x : out.origin) x = get_number(in, -1e13, 1e13);
  out.step = get_number(in, 1e-300, 1e13);
  return out;
}

double get_number(ByteReader& in, double least, double most) {
  const auto value = in.get<double>();
  if (!(value >= least && value <= most)) in.fail("a number out of range", "one that the encoder writes (damaged)");
  return value;
}

}  // namespace kinespace
