#include "kinespace/mesh/mesh_report.h"

#include <limits>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/connectivity.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

TEST(MeshReport, closed_surface_obeys_euler) {
  const MeshSequence tube = bending_tube(320, 3, 1.0);
  const MeshReport r = report(tube);
  EXPECT_EQ(r.vertices - r.edges + r.triangles, 2);
  EXPECT_TRUE(r.watertight());
  EXPECT_EQ(r.components, 1);
  EXPECT_EQ(r.inconsistent_edges, 0);
  EXPECT_EQ(r.flat_triangles, 0);
}

TEST(MeshReport, sheet_has_its_border_as_boundary) {
  const MeshReport r = report(sheet(7, 5, 2));
  EXPECT_EQ(r.boundary_edges, 2 * (6 + 4));
  EXPECT_EQ(r.boundary_loops, 1);
  EXPECT_FALSE(r.watertight());
}

TEST(MeshReport, counts_what_is_odd) {
  MeshSequence mesh = tetrahedron();
  mesh.vertices = 6;
  for (const float x : {5.F, 5.F, 5.F, 2.F, 0.F, 0.F}) mesh.positions.push_back(x);
  mesh.triangles.push_back({1, 0, 2});  // a duplicate, the other way round
  mesh.triangles.push_back({3, 3, 1});  // degenerate
  mesh.triangles.push_back({0, 1, 5});  // flat, and a third one at the edge 0-1
  const MeshReport r = report(mesh);
  EXPECT_EQ(r.duplicate_triangles, 1);
  EXPECT_EQ(r.degenerate_triangles, 1);
  EXPECT_EQ(r.flat_triangles, 1);
  EXPECT_EQ(r.nonmanifold_edges, 1);
  EXPECT_EQ(r.boundary_edges, 2);
  EXPECT_EQ(r.isolated_vertices, 1);
  EXPECT_EQ(r.components, 1);
}

TEST(MeshReport, two_meshes_are_two_components_and_a_turned_triangle_is_seen) {
  MeshSequence mesh = joined(tetrahedron(), tetrahedron());
  EXPECT_EQ(report(mesh).components, 2);
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  EXPECT_EQ(report(mesh).inconsistent_edges, 3);
}

TEST(Connectivity, neighbours_are_the_one_ring) {
  const MeshSequence mesh = sheet(3, 3, 1);
  const Neighbours neighbours(mesh.vertices, mesh.triangles);
  const auto middle = neighbours.of(4);
  EXPECT_EQ(std::vector<std::int32_t>(middle.begin(), middle.end()), (std::vector<std::int32_t>{1, 2, 3, 5, 6, 7}));
  EXPECT_EQ(neighbours.edges(), 16U);
}

TEST(MeshSequence, bad_values_are_refused_by_name) {
  const MeshSequence good = sheet(4, 4, 3);
  EXPECT_NO_THROW(require_valid(good, "here"));
  MeshSequence bad = good;
  bad.positions[bad.frame_size() + 5] = std::numeric_limits<float>::quiet_NaN();
  try {
    require_valid(bad, "here");
    FAIL() << "a NaN was taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_EQ(error.details().found, "coordinate z of vertex 1 in frame 1 is nan");
  }
  bad = good;
  bad.triangles[2][1] = 16;
  EXPECT_THROW(require_valid(bad, "here"), Error);
  bad.triangles[2][1] = -1;
  EXPECT_THROW(require_valid(bad, "here"), Error);
  bad = good;
  bad.positions.pop_back();
  EXPECT_THROW(require_valid(bad, "here"), Error);
  bad = good;
  bad.rate_hz = 0;
  EXPECT_THROW(require_valid(bad, "here"), Error);
}

}  // namespace
}  // namespace kinespace::test
