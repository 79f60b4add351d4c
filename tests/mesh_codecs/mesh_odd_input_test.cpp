// Sequences that are hard on a mesh codec, for every codec and profile: what is kept, what is refused and how.
#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh/mesh_report.h"
#include "kinespace/mesh_codecs/mesh_codec.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

struct OddKind {
  std::string name;
  std::string codec;
  MeshCodecOptions options;
};

class OddMesh : public testing::TestWithParam<OddKind> {
 protected:
  [[nodiscard]] static Bytes encode(const MeshSequence& mesh) {
    return encode_mesh(GetParam().codec, mesh, GetParam().options);
  }
  // Goes there and back with its name, counts and triangles, no farther off than was asked.
  static void expect_kept(const MeshSequence& mesh) {
    const Bytes stream = encode(mesh);
    const MeshSequence back = open_mesh_stream(stream, "s")->decode_all();
    EXPECT_EQ(back.frames, mesh.frames);
    EXPECT_EQ(back.triangles, canonical_triangles(mesh.triangles));
    EXPECT_LE(compare_positions(mesh, back).kg, *GetParam().options.kg);
  }
};
INSTANTIATE_TEST_SUITE_P(All, OddMesh,
                         testing::Values(OddKind{"standard", "mesh-harmonics", {.kg = 2.0}},
                                         OddKind{"coarse", "mesh-harmonics", {.kg = 4.0, .coarse_vertices = 150}},
                                         OddKind{"paper", "mesh-harmonics", {.kg = 2.0, .profile = MeshProfile::paper}},
                                         OddKind{"pca", "mesh-pca", {.kg = 2.0}},
                                         OddKind{"draco", "mesh-draco", {.kg = 2.0}}),
                         [](const auto& kind) { return kind.param.name; });

MeshSequence small_tube() {
  return bending_tube(250, 6, 1.0);
}

// The same vertices, all at the place of the first frame.
MeshSequence standing(int frames) {
  MeshSequence out = bending_tube(250, 1, 1.0);
  const std::vector<float> first = out.positions;
  for (out.frames = 1; out.frames < frames; ++out.frames) {
    out.positions.insert(out.positions.end(), first.begin(), first.end());
  }
  return out;
}

// Another vertex, without triangles, that moves on its own.
MeshSequence with_isolated_vertex(const MeshSequence& mesh) {
  MeshSequence out = mesh;
  out.positions.clear();
  for (int f = 0; f < mesh.frames; ++f) {
    out.positions.insert(out.positions.end(), mesh.frame(f).begin(), mesh.frame(f).end());
    out.positions.insert(out.positions.end(), {1.0F, 2.0F + 0.1F * static_cast<float>(f), 0.5F});
  }
  ++out.vertices;
  return out;
}

TEST_P(OddMesh, degenerate_triangles_are_kept) {
  MeshSequence mesh = small_tube();
  mesh.triangles.push_back({3, 3, 7});
  mesh.triangles.push_back({9, 9, 9});
  ASSERT_EQ(report(mesh).degenerate_triangles, 2);
  expect_kept(mesh);
}

TEST_P(OddMesh, triangles_without_area_are_kept) {
  MeshSequence mesh = small_tube();
  for (int f = 0; f < mesh.frames; ++f) {
    for (int v = 40; v < 44; ++v) std::copy_n(mesh.frame(f).begin(), 3, mesh.frame(f).begin() + std::ptrdiff_t{3} * v);
  }
  ASSERT_GT(report(mesh).flat_triangles, 0);
  expect_kept(mesh);
}

TEST_P(OddMesh, duplicate_triangles_are_kept) {
  MeshSequence mesh = small_tube();
  mesh.triangles.push_back(mesh.triangles[5]);
  mesh.triangles.push_back(mesh.triangles[5]);
  ASSERT_EQ(report(mesh).duplicate_triangles, 2);
  expect_kept(mesh);
}

TEST_P(OddMesh, non_manifold_edges_are_kept) {
  MeshSequence mesh = small_tube();
  const Triangle t = mesh.triangles[8];
  mesh.triangles.push_back({t[0], t[1], 200});
  mesh.triangles.push_back({t[1], t[0], 100});
  ASSERT_GT(report(mesh).nonmanifold_edges, 0);
  expect_kept(mesh);
}

TEST_P(OddMesh, isolated_vertices_are_kept) {
  const MeshSequence mesh = with_isolated_vertex(small_tube());
  ASSERT_EQ(report(mesh).isolated_vertices, 1);
  expect_kept(mesh);
}

TEST_P(OddMesh, several_components_are_kept) {
  const MeshSequence mesh = joined(small_tube(), bending_tube(100, 6, 0.5));
  ASSERT_EQ(report(mesh).components, 2);
  expect_kept(mesh);
}

TEST_P(OddMesh, open_boundaries_are_kept) {
  const MeshSequence mesh = sheet(18, 14, 6);
  ASSERT_GT(report(mesh).boundary_edges, 0);
  expect_kept(mesh);
}

TEST_P(OddMesh, one_frame_is_kept) {
  expect_kept(bending_tube(250, 1, 1.0));
}

TEST_P(OddMesh, standing_still_is_kept) {
  expect_kept(standing(10));
}

TEST_P(OddMesh, a_mesh_that_is_one_point_is_kept) {
  MeshSequence point{.name = "point", .vertices = 1, .frames = 2};
  point.positions = {1, 2, 3, 1, 2, 3};
  const MeshSequence back = open_mesh_stream(encode(point), "s")->decode_all();
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(back.positions[i], point.positions[i], 1e-4);
}

// What is told of the error is so, in millionths of a hair and in kilometres; else it is an error of the call.
TEST_P(OddMesh, a_mesh_of_any_size_is_kept_or_refused) {
  for (const float scale : {1e-30F, 1e-15F, 1e-6F, 1e6F}) {
    MeshSequence mesh = small_tube();
    for (float& x : mesh.positions) x *= scale;
    try {
      expect_kept(mesh);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage) << scale << ": " << error.what();
      EXPECT_LT(scale, 1e-20F) << error.what();
    }
  }
}

TEST_P(OddMesh, numbers_that_are_not_finite_are_refused_by_frame_and_vertex) {
  for (const float number : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    MeshSequence mesh = small_tube();
    mesh.frame(3)[3 * 17 + 1] = number;
    try {
      static_cast<void>(encode(mesh));
      ADD_FAILURE() << "encoded";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      EXPECT_NE(std::string(error.what()).find("17"), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find('3'), std::string::npos) << error.what();
    }
  }
}

TEST_P(OddMesh, triangles_of_vertices_that_are_not_there_are_refused) {
  MeshSequence mesh = small_tube();
  mesh.triangles[4][1] = mesh.vertices;
  try {
    static_cast<void>(encode(mesh));
    ADD_FAILURE() << "encoded";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  }
}

TEST_P(OddMesh, more_bases_than_vertices_are_refused_with_their_number) {
  const MeshSequence mesh = small_tube();
  MeshCodecOptions options = GetParam().options;
  options.bases = mesh.vertices + 1;
  try {
    static_cast<void>(encode_mesh(GetParam().codec, mesh, options));
    ADD_FAILURE() << "encoded";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_NE(std::string(error.what()).find(std::to_string(mesh.vertices + 1)), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace kinespace::test
