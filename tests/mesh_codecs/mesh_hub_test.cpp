// Vertices with thousands of neighbours, and meshes that take next to no bytes: what is encoded is decoded.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh_codecs/detail/vertex_order.h"
#include "kinespace/mesh_codecs/key_mesh.h"
#include "kinespace/mesh_codecs/mesh_codec.h"
#include "kinespace/mesh_codecs/mesh_layout.h"

namespace kinespace::test {
namespace {

// Points on a circle that breathes from frame to frame, with a hub in its middle.
MeshSequence circle(int rim, int frames) {
  MeshSequence out{.name = "hub", .vertices = rim + 1, .frames = frames};
  for (int f = 0; f < frames; ++f) {
    out.positions.insert(out.positions.end(), {0, 0, 0.1F * static_cast<float>(f)});
    for (int i = 0; i < rim; ++i) {
      const double angle = 2 * std::numbers::pi * i / rim, size = 1 + 0.05 * f;
      out.positions.push_back(static_cast<float>(size * std::cos(angle)));
      out.positions.push_back(static_cast<float>(size * std::sin(angle)));
      out.positions.push_back(0);
    }
  }
  return out;
}

MeshSequence fan(int rim, int frames) {
  MeshSequence out = circle(rim, frames);
  for (int i = 0; i < rim; ++i) out.triangles.push_back({0, 1 + i, 1 + (i + 1) % rim});
  return out;
}

// Triangles that meet in the hub alone.
MeshSequence bowtie(int rim, int frames) {
  MeshSequence out = circle(rim, frames);
  for (int i = 0; i + 1 < rim; i += 2) out.triangles.push_back({0, 1 + i, 2 + i});
  return out;
}

// A star of fins: every triangle at the one edge of the first two vertices.
MeshSequence fins(int rim, int frames) {
  MeshSequence out = circle(rim, frames);
  for (int i = 1; i < rim; ++i) out.triangles.push_back({0, 1, 1 + i});
  return out;
}

MeshSequence strip(int rim, int frames) {
  MeshSequence out = circle(rim, frames);
  for (int i = 0; i + 2 < rim; ++i) out.triangles.push_back({1 + i, 2 + i, 3 + i});
  return out;
}

// One face with all corners, as polygons are cut.
MeshSequence polygon(int rim, int frames) {
  MeshSequence out = circle(rim, frames);
  for (int i = 2; i < rim; ++i) out.triangles.push_back({1, i, 1 + i});
  return out;
}

// Every triangle that few vertices can have: more of them than a splitting coder has room for.
MeshSequence soup(int, int frames) {
  MeshSequence out = circle(9, frames);
  for (int a = 0; a < 10; ++a) {
    for (int b = a + 1; b < 10; ++b) {
      for (int c = b + 1; c < 10; ++c) out.triangles.push_back({a, b, c});
    }
  }
  return out;
}

struct Shape {
  const char* name;
  MeshSequence (*make)(int rim, int frames);
};
constexpr Shape shapes[] = {{"fan", fan},     {"bowtie", bowtie},   {"fins", fins},
                            {"strip", strip}, {"polygon", polygon}, {"soup", soup}};

void expect_kept(const std::string& codec, const MeshSequence& mesh, const MeshCodecOptions& options) {
  try {
    const Bytes stream = encode_mesh(codec, mesh, options);
    const MeshSequence back = open_mesh_stream(stream, "s")->decode_all();
    EXPECT_EQ(back.triangles, canonical_triangles(mesh.triangles));
    EXPECT_LE(compare_positions(mesh, back).kg, *options.kg);
  } catch (const Error& error) {
    ADD_FAILURE() << error.what();
  }
}

TEST(MeshHub, of_many_triangles_is_kept_by_every_codec) {
  for (const Shape& shape : shapes) {
    for (const int frames : {1, 3}) {
      const MeshSequence mesh = shape.make(600, frames);
      const int bases = std::min(40, mesh.vertices);
      SCOPED_TRACE(testing::Message() << shape.name << ", " << frames << " frames");
      expect_kept("mesh-pca", mesh, {.kg = 1.0});
      expect_kept("mesh-draco", mesh, {.kg = 1.0});
      expect_kept("mesh-harmonics", mesh, {.kg = 5.0, .bases = bases});
      expect_kept("mesh-harmonics", mesh, {.kg = 20.0, .profile = MeshProfile::paper, .bases = bases});
      expect_kept("mesh-harmonics", mesh, {.kg = 20.0, .bases = std::min(10, bases), .coarse_vertices = 100});
    }
  }
}

// 4 million numbers of functions for a stream of hardly a kilobyte.
TEST(MeshHub, in_a_stream_of_few_bytes_is_believed) {
  expect_kept("mesh-harmonics", fan(80'000, 1), {.kg = 50.0, .bases = 50});
}

// 262 144 vertices and as many triangles, all in one place: a reader wants 3 KB of stream for them.
TEST(MeshHub, of_vertices_in_one_place_is_kept) {
  MeshSequence mesh = polygon(262'143, 1);
  std::fill(mesh.positions.begin(), mesh.positions.end(), 1.0F);
  for (const char* codec : {"mesh-pca", "mesh-draco"}) expect_kept(codec, mesh, {.kg = 50.0});
}

TEST(MeshHub, large_and_tiny_meshes_are_kept) {
  for (const float size : {1e-6F, 1.0F, 1e11F}) {
    for (const int frames : {1, 4}) {
      MeshSequence mesh = fan(100, frames);
      for (float& x : mesh.positions) x *= size;
      SCOPED_TRACE(testing::Message() << size << ", " << frames << " frames");
      for (const char* codec : {"mesh-pca", "mesh-draco", "mesh-harmonics"}) expect_kept(codec, mesh, {.kg = 20.0});
    }
  }
}

TEST(MeshHub, layouts_at_every_limit_are_believed) {
  for (const int vertices : {1, 65'536, 65'537, 300'000, 100'000'000}) {
    for (const int frames : {1, 300, 1 << 20}) {
      for (const std::int64_t triangles : {0, 131'072, 131'073, 200'000'000}) {
        if (std::int64_t{vertices} * frames > std::int64_t{1} << 31) continue;
        const MeshLayout layout{.vertices = vertices, .frames = frames, .triangles = triangles};
        const Bytes stream = finish_mesh_stream(BitstreamWriter("mesh-codec:mesh-pca"), layout);
        ByteWriter described;
        put_layout(described, layout);
        const Bytes written = std::move(described).take();
        ByteReader in(written, "s");
        EXPECT_NO_THROW(static_cast<void>(get_layout(in, stream.size())))
            << vertices << " " << frames << " " << triangles;
      }
    }
  }
}

TEST(MeshHub, what_no_reader_takes_is_refused_by_the_encoder) {
  MeshSequence slow = fan(5, 1);
  slow.rate_hz = 1e-10;
  EXPECT_THROW(static_cast<void>(encode_mesh("mesh-pca", slow)), Error);
  MeshSequence long_one = fan(3, 1);
  long_one.frames = (1 << 20) + 1;
  long_one.positions.resize(long_one.frame_size() * static_cast<std::size_t>(long_one.frames));
  for (const char* codec : {"mesh-pca", "mesh-harmonics"}) {
    EXPECT_THROW(static_cast<void>(encode_mesh(codec, long_one)), Error);
  }
  const MeshLayout layout{.vertices = 10, .frames = 10};
  EXPECT_THROW(static_cast<void>(finish_mesh_stream(BitstreamWriter("mesh-codec:mesh-pca"), layout, 1LL << 40)), Error);
}

// The order's cost for a hub that comes last, as long as it is wanted by everybody.
TEST(MeshHub, costs_in_proportion_to_its_neighbours) {
  const auto looked_at = [](int rim) {
    std::vector<std::int32_t> point_of;
    for (int v = rim; v >= 0; --v) point_of.push_back(v);
    IntegerWriter out;
    return put_order(out, point_of, fan(rim, 1).triangles);
  };
  for (const int rim : {1000, 10'000}) EXPECT_LE(looked_at(rim), 25 * 4 * rim);
}

// Draco takes the square of a hub's triangles; a face of 300 000 corners goes without it.
TEST(MeshHub, of_a_face_with_300_000_corners_is_packed_without_draco) {
  const auto packed = [](int corners) {
    const MeshSequence mesh = polygon(corners, 1);
    return pack_key_mesh({.vertices = mesh.vertices,
                          .triangles = mesh.triangles,
                          .keys = {std::vector<GridPoint>(static_cast<std::size_t>(mesh.vertices))}});
  };
  EXPECT_FALSE(packed(1000).surface.empty());
  const PackedKeyMesh large = packed(300'000);
  EXPECT_TRUE(large.surface.empty());
  EXPECT_LT(large.order.size(), 1'000'000U);
  const KeyMesh back = unpack_key_mesh(large.surface, large.order, 300'001, 299'998, 1, "s");
  EXPECT_EQ(back.triangles, canonical_triangles(polygon(300'000, 1).triangles));
}

}  // namespace
}  // namespace kinespace::test
