#include "kinespace/mesh_codecs/key_mesh.h"

#include <algorithm>
#include <optional>

#include "kinespace/base/error.h"
#include "kinespace/entropy/integer_coder.h"
#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh_codecs/detail/draco_surface.h"
#include "kinespace/mesh_codecs/detail/vertex_order.h"

namespace kinespace {
namespace {

constexpr std::int64_t most_coordinate = std::int64_t{1} << 30;
// Draco walks around a vertex once for each triangle there: beyond so many steps in all (a fan of 23 000 triangles) it
// takes longer than its bytes are worth.
constexpr std::int64_t most_draco_steps = std::int64_t{1} << 29;
constexpr int count_context = 8, lost_context = 9, split_context = 10, triangle_context = 11, position_context = 12;

// How Draco's points become vertices.
struct PointMap {
  std::vector<std::int32_t> vertex_of;  // by point
  std::vector<std::int32_t> lost;       // vertices without a point, ascending
  std::vector<std::int32_t> copies;     // points whose vertex has a lower point already, ascending
};

PointMap map_points(std::vector<std::int32_t> vertex_of, int vertices) {
  PointMap out;
  std::vector<std::uint8_t> has(static_cast<std::size_t>(vertices));
  for (std::size_t p = 0; p < vertex_of.size(); ++p) {
    std::uint8_t& seen = has[static_cast<std::size_t>(vertex_of[p])];
    if (seen != 0) out.copies.push_back(static_cast<std::int32_t>(p));
    seen = 1;
  }
  for (int v = 0; v < vertices; ++v) {
    if (has[static_cast<std::size_t>(v)] == 0) out.lost.push_back(v);
  }
  out.vertex_of = std::move(vertex_of);
  return out;
}

// Numbers of what is left when some are taken out, ascending lists.
std::vector<std::int32_t> without(int count, std::span<const std::int32_t> left_out) {
  std::vector<std::int32_t> out;
  std::size_t at = 0;
  for (int i = 0; i < count; ++i) {
    if (at < left_out.size() && left_out[at] == i) {
      ++at;
    } else {
      out.push_back(i);
    }
  }
  return out;
}

void put_ascending(IntegerWriter& out, std::span<const std::int32_t> numbers, int context) {
  out.put(static_cast<std::int64_t>(numbers.size()), count_context);
  std::int64_t next = 0;
  for (const std::int32_t n : numbers) {
    out.put(n - next, context);
    next = n + 1;
  }
}

std::vector<std::int32_t> get_ascending(IntegerReader& in, int limit, int context) {
  const std::int64_t count = in.get_between(0, limit, count_context);
  std::vector<std::int32_t> out;
  std::int64_t next = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    next += in.get_between(0, limit - 1 - next, context);
    out.push_back(static_cast<std::int32_t>(next++));
  }
  return out;
}

void put_triangles(IntegerWriter& out, std::span<const Triangle> triangles) {
  out.put(static_cast<std::int64_t>(triangles.size()), count_context);
  Triangle before{};
  for (const Triangle& t : triangles) {
    out.put(t[0] - before[0], triangle_context);
    out.put(t[1] - t[0], triangle_context);
    out.put(t[2] - t[1], triangle_context);
    before = t;
  }
}

std::vector<Triangle> get_triangles(IntegerReader& in, int vertices, std::int64_t most) {
  const std::int64_t count = in.get_between(0, most, count_context);
  std::vector<Triangle> out;
  Triangle t{};
  for (std::int64_t i = 0; i < count; ++i) {
    std::int64_t at = t[0];
    for (std::size_t k = 0; k < 3; ++k) {
      at += in.get_between(-vertices, vertices, triangle_context);
      if (at < 0 || at >= vertices) in.damaged();
      t[k] = static_cast<std::int32_t>(at);
    }
    out.push_back(t);
  }
  return out;
}

void put_positions(IntegerWriter& out, const KeyMesh& mesh, std::span<const std::int32_t> vertices) {
  for (const auto& key : mesh.keys) {
    GridPoint before{};
    for (const std::int32_t v : vertices) {
      const GridPoint& p = key[static_cast<std::size_t>(v)];
      for (std::size_t d = 0; d < 3; ++d)
        out.put(std::int64_t{p[d]} - before[d], position_context + static_cast<int>(d));
      before = p;
    }
  }
}

void get_positions(IntegerReader& in, KeyMesh& mesh, std::span<const std::int32_t> vertices) {
  for (auto& key : mesh.keys) {
    GridPoint p{};
    for (const std::int32_t v : vertices) {
      for (std::size_t d = 0; d < 3; ++d) {
        const std::int64_t at = p[d] + in.get(position_context + static_cast<int>(d));
        if (at < -most_coordinate || at > most_coordinate) in.damaged();
        p[d] = static_cast<std::int32_t>(at);
      }
      key[static_cast<std::size_t>(v)] = p;
    }
  }
}

// What `all` has more of than `some`; none when `some` is not part of it. Both canonical.
std::optional<std::vector<Triangle>> difference(std::span<const Triangle> all, std::span<const Triangle> some) {
  if (!std::includes(all.begin(), all.end(), some.begin(), some.end())) return {};
  std::vector<Triangle> out;
  std::set_difference(all.begin(), all.end(), some.begin(), some.end(), std::back_inserter(out));
  return out;
}

struct DracoPart {
  Bytes bytes;
  std::vector<Triangle> triangles;  // of points
  PointMap map;
  std::vector<Triangle> missing;  // of vertices, canonical
};

// Draco numbers points otherwise where there are labels, but triangles and their corners come in the same order.
std::optional<std::vector<std::int32_t>> labels_of(const Surface& plain, const Surface& told, int vertices) {
  if (told.label.size() != static_cast<std::size_t>(told.points) || told.triangles.size() != plain.triangles.size()) {
    return {};
  }
  std::vector<std::int32_t> out(static_cast<std::size_t>(plain.points), -1);
  for (std::size_t t = 0; t < plain.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int32_t label = told.label[static_cast<std::size_t>(told.triangles[t][i])];
      std::int32_t& known = out[static_cast<std::size_t>(plain.triangles[t][i])];
      if (label < 0 || label >= vertices || (known >= 0 && known != label)) return {};
      known = label;
    }
  }
  if (std::any_of(out.begin(), out.end(), [](std::int32_t label) { return label < 0; })) return {};
  return out;
}

// Every point has the position of its vertex.
bool agrees(const Surface& plain, std::span<const std::int32_t> vertex_of, const KeyMesh& mesh) {
  for (std::size_t k = 0; k < mesh.keys.size(); ++k) {
    for (std::size_t p = 0; p < vertex_of.size(); ++p) {
      if (plain.keys[k][p] != mesh.keys[k][static_cast<std::size_t>(vertex_of[p])]) return false;
    }
  }
  return true;
}

// At least: what is beyond the limit is not counted on.
std::int64_t draco_steps(const KeyMesh& mesh) {
  std::vector<std::int64_t> around(static_cast<std::size_t>(mesh.vertices));
  for (const Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) ++around[static_cast<std::size_t>(v)];
  }
  std::int64_t out = 0;
  for (const std::int64_t n : around) {
    out += n * n;
    if (out > most_draco_steps) break;
  }
  return out;
}

// A label on every point tells which vertex it was; then the same mesh without the labels.
std::optional<DracoPart> with_draco(const KeyMesh& mesh) {
  Surface surface{.points = mesh.vertices, .triangles = mesh.triangles, .keys = mesh.keys, .label = {}};
  std::vector<std::int32_t> label(static_cast<std::size_t>(mesh.vertices));
  for (int v = 0; v < mesh.vertices; ++v) label[static_cast<std::size_t>(v)] = v;
  auto bytes = draco_encode(surface);
  surface.label = std::move(label);
  const auto labelled = draco_encode(surface);
  if (!bytes || !labelled) return {};
  const auto faces = static_cast<std::int64_t>(mesh.triangles.size());
  const auto keys = static_cast<int>(mesh.keys.size());
  Surface plain, told;
  try {
    plain = draco_decode(*bytes, mesh.vertices * 4, faces, keys, false, "");
    told = draco_decode(*labelled, mesh.vertices * 4, faces, keys, true, "");
  } catch (const Error&) {
    return {};  // cut into more points than a reader takes, say
  }
  auto vertex_of = labels_of(plain, told, mesh.vertices);
  if (!vertex_of || !agrees(plain, *vertex_of, mesh)) return {};
  DracoPart out{.bytes = std::move(*bytes), .triangles = std::move(plain.triangles), .map = {}, .missing = {}};
  out.map = map_points(std::move(*vertex_of), mesh.vertices);
  std::vector<Triangle> coded = out.triangles;
  for (Triangle& t : coded) {
    for (std::int32_t& p : t) p = out.map.vertex_of[static_cast<std::size_t>(p)];
  }
  const auto all = canonical_triangles(mesh.triangles);
  const auto missing = difference(all, canonical_triangles(std::move(coded)));
  if (!missing) return {};
  out.missing = *missing;
  return out;
}

// Triangles between the points that are kept, numbered among these.
std::vector<Triangle> among(std::span<const Triangle> triangles, std::span<const std::int32_t> kept, int points) {
  std::vector<std::int32_t> number(static_cast<std::size_t>(points), -1);
  for (std::size_t i = 0; i < kept.size(); ++i)
    number[static_cast<std::size_t>(kept[i])] = static_cast<std::int32_t>(i);
  std::vector<Triangle> out;
  for (const Triangle& t : triangles) {
    const Triangle n{number[static_cast<std::size_t>(t[0])], number[static_cast<std::size_t>(t[1])],
                     number[static_cast<std::size_t>(t[2])]};
    if (n[0] >= 0 && n[1] >= 0 && n[2] >= 0) out.push_back(n);
  }
  return out;
}

Bytes put_draco_corrections(const KeyMesh& mesh, const DracoPart& part) {
  IntegerWriter out;
  const auto points = static_cast<int>(part.map.vertex_of.size());
  put_ascending(out, part.map.copies, split_context);
  put_ascending(out, part.map.lost, lost_context);
  for (const std::int32_t p : part.map.copies) out.put(part.map.vertex_of[static_cast<std::size_t>(p)], split_context);
  const auto kept = without(points, part.map.copies);
  const auto present = without(mesh.vertices, part.map.lost);
  std::vector<std::int32_t> place(static_cast<std::size_t>(mesh.vertices), -1);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    place[static_cast<std::size_t>(part.map.vertex_of[static_cast<std::size_t>(kept[i])])] =
        static_cast<std::int32_t>(i);
  }
  std::vector<std::int32_t> point_of;
  point_of.reserve(present.size());
  for (const std::int32_t v : present) point_of.push_back(place[static_cast<std::size_t>(v)]);
  put_order(out, point_of, among(part.triangles, kept, points));
  put_triangles(out, part.missing);
  put_positions(out, mesh, part.map.lost);
  return std::move(out).finish();
}

void get_draco(std::span<const std::byte> surface, IntegerReader& in, std::int64_t triangles, const std::string& source,
               KeyMesh& mesh) {
  const auto keys = static_cast<int>(mesh.keys.size());
  const Surface decoded = draco_decode(surface, mesh.vertices * 4, triangles, keys, false, source);
  const auto copies = get_ascending(in, decoded.points, split_context);
  const auto lost = get_ascending(in, mesh.vertices, lost_context);
  const auto kept = without(decoded.points, copies);
  const auto present = without(mesh.vertices, lost);
  if (kept.size() != present.size()) in.damaged();
  std::vector<std::int32_t> vertex_of(static_cast<std::size_t>(decoded.points), -1);
  for (const std::int32_t p : copies) {
    vertex_of[static_cast<std::size_t>(p)] =
        static_cast<std::int32_t>(in.get_between(0, mesh.vertices - 1, split_context));
  }
  const auto point_of = get_order(in, static_cast<int>(present.size()), among(decoded.triangles, kept, decoded.points));
  for (std::size_t i = 0; i < present.size(); ++i) {
    const std::int32_t p = kept[static_cast<std::size_t>(point_of[i])];
    vertex_of[static_cast<std::size_t>(p)] = present[i];
    for (std::size_t k = 0; k < mesh.keys.size(); ++k) {
      mesh.keys[k][static_cast<std::size_t>(present[i])] = decoded.keys[k][static_cast<std::size_t>(p)];
    }
  }
  for (Triangle t : decoded.triangles) {
    for (std::int32_t& p : t) p = vertex_of[static_cast<std::size_t>(p)];
    mesh.triangles.push_back(t);
  }
  const auto missing = get_triangles(in, mesh.vertices, triangles - static_cast<std::int64_t>(mesh.triangles.size()));
  mesh.triangles.insert(mesh.triangles.end(), missing.begin(), missing.end());
  get_positions(in, mesh, lost);
}

void check(const KeyMesh& mesh, std::int64_t triangles, IntegerReader& in) {
  in.expect_end();
  if (static_cast<std::int64_t>(mesh.triangles.size()) != triangles) in.damaged();
  for (const auto& key : mesh.keys) {
    for (const GridPoint& p : key) {
      for (const std::int32_t x : p) {
        if (x < -most_coordinate || x > most_coordinate) in.damaged();
      }
    }
  }
}

std::vector<std::int32_t> all_of(int vertices) {
  return without(vertices, {});
}

}  // namespace

PackedKeyMesh pack_key_mesh(const KeyMesh& mesh) {
  const auto part = draco_steps(mesh) <= most_draco_steps ? with_draco(mesh) : std::nullopt;
  if (part) {
    return {.surface = part->bytes, .order = put_draco_corrections(mesh, *part)};
  }
  IntegerWriter out;
  put_triangles(out, canonical_triangles(mesh.triangles));
  put_positions(out, mesh, all_of(mesh.vertices));
  return {.surface = {}, .order = std::move(out).finish()};
}

KeyMesh unpack_key_mesh(std::span<const std::byte> surface, std::span<const std::byte> order, int vertices,
                        std::int64_t triangles, int keys, const std::string& source) {
  KeyMesh out;
  out.vertices = vertices;
  out.keys.assign(static_cast<std::size_t>(keys), std::vector<GridPoint>(static_cast<std::size_t>(vertices)));
  IntegerReader in(order, source);
  if (surface.empty()) {
    out.triangles = get_triangles(in, vertices, triangles);
    get_positions(in, out, all_of(vertices));
  } else {
    get_draco(surface, in, triangles, source, out);
  }
  check(out, triangles, in);
  out.triangles = canonical_triangles(std::move(out.triangles));
  return out;
}

std::int64_t connectivity_size(const KeyMesh& mesh) {
  KeyMesh flat = mesh;
  flat.keys.assign(1, std::vector<GridPoint>(static_cast<std::size_t>(mesh.vertices)));
  const PackedKeyMesh packed = pack_key_mesh(flat);
  return static_cast<std::int64_t>(packed.surface.size() + packed.order.size());
}

}  // namespace kinespace
