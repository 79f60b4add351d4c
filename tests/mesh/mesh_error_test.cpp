#include "kinespace/mesh/mesh_error.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

TEST(MeshError, is_zero_for_the_same_sequence) {
  const MeshSequence mesh = bending_tube(400, 3, 1.0);
  const MeshError e = compare(mesh, mesh);
  EXPECT_EQ(e.kg, 0);
  EXPECT_EQ(e.kg_time, 0);
  EXPECT_LT(e.lr, 1e-15);
  EXPECT_EQ(e.max_vertex_error, 0);
}

TEST(MeshError, kg_is_relative_to_the_spread_about_the_centroids) {
  const MeshSequence a = sheet(5, 4, 3);
  MeshSequence scaled = a;
  for (int f = 0; f < a.frames; ++f) {
    const Points x = frame_points(a, f);
    const Eigen::RowVector3d centre = x.colwise().mean();
    set_frame(scaled, f, ((x.rowwise() - centre) * 1.02).rowwise() + centre);
  }
  EXPECT_NEAR(compare_positions(a, scaled).kg, 2.0, 1e-4);
  // A frame does not count less for being far away.
  EXPECT_NEAR(compare_positions(moved_rigidly(a, 0), moved_rigidly(scaled, 0)).kg, 2.0, 1e-4);
}

TEST(MeshError, kg_time_is_relative_to_the_motion) {
  const MeshSequence a = sheet(5, 4, 4);
  MeshSequence still = a;
  Points mean = Points::Zero(a.vertices, 3);
  for (int f = 0; f < a.frames; ++f) mean += frame_points(a, f) / a.frames;
  for (int f = 0; f < a.frames; ++f) set_frame(still, f, mean);
  EXPECT_NEAR(compare_positions(a, still).kg_time, 100, 1e-3);
  EXPECT_LT(compare_positions(a, still).kg, 40);
  EXPECT_TRUE(std::isnan(compare_positions(still, a).kg_time)) << "a still reference has no motion to compare with";
}

TEST(MeshError, frames_that_are_all_alike_do_not_move_at_all) {
  MeshSequence still = sheet(5, 4, 10);
  for (int f = 1; f < still.frames; ++f) set_frame(still, f, 1.0 / 3 * frame_points(still, 0));
  set_frame(still, 0, frame_points(still, 1));
  MeshSequence off = still;
  set_frame(off, 4, frame_points(still, 4) * 1.001);
  EXPECT_TRUE(std::isnan(compare_positions(still, off).kg_time));
}

TEST(MeshError, local_rigidity_is_zero_under_rigid_motion) {
  const MeshSequence mesh = bending_tube(800, 4, 1.5);
  EXPECT_LT(compare(mesh, moved_rigidly(mesh, 0.7)).lr, 1e-7);
  EXPECT_GT(compare(mesh, moved_rigidly(mesh, 0.7)).kg, 10);
}

TEST(MeshError, local_rigidity_sees_roughness_that_kg_does_not) {
  const MeshSequence mesh = bending_tube(800, 1, 1.0);
  MeshSequence rough = mesh, smooth = mesh;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    rough.positions[i] += i % 2 == 0 ? 0.01F : -0.01F;
    smooth.positions[i] += 0.01F;
  }
  EXPECT_NEAR(compare(mesh, rough).kg, compare(mesh, smooth).kg, 1e-3);
  EXPECT_GT(compare(mesh, rough).lr, 1000 * compare(mesh, smooth).lr);
}

// Two triangles at an edge; one vertex leaves its place. By hand: only stretches count, no turns.
TEST(MeshError, local_rigidity_is_as_computed_by_hand) {
  MeshSequence a{.name = "path", .vertices = 3, .frames = 1, .positions = {0, 0, 0, 1, 0, 0, 0, 1, 0}};
  a.triangles = {{0, 1, 2}};
  MeshSequence b = a;
  for (float& x : b.positions) x *= 2;
  // Every vertex has two neighbours, w = 1/4; edges 1, 1 and sqrt 2 double, each seen from both ends.
  const double energy = 2 * (1 + 1 + 2) / 4.0;
  EXPECT_NEAR(compare(a, b).lr, 1e4 / 2 * energy, 1e-6);
  double sum = 0;
  for (const double e : vertex_rigidity_errors(a, b, 0)) sum += e;
  EXPECT_NEAR(sum, compare(a, b).lr, 1e-9);
  EXPECT_NEAR(vertex_errors(a, b, 0)[1], 1, 1e-12);
}

TEST(MeshError, other_shapes_are_refused) {
  const MeshSequence mesh = sheet(4, 4, 3);
  EXPECT_THROW((void)compare(mesh, sheet(4, 4, 2)), Error);
  EXPECT_THROW((void)compare(mesh, sheet(4, 5, 3)), Error);
  MeshSequence turned = mesh;
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  EXPECT_THROW((void)compare(mesh, turned), Error);
}

TEST(MeshError, the_order_of_triangles_and_where_they_begin_do_not_matter) {
  const MeshSequence mesh = sheet(4, 4, 3);
  MeshSequence other = mesh;
  std::swap(other.triangles[0], other.triangles[1]);
  std::ranges::rotate(other.triangles[2], other.triangles[2].begin() + 1);
  EXPECT_EQ(compare(mesh, other).kg, 0);
  EXPECT_EQ(compare(mesh, other).lr, 0);
}

}  // namespace
}  // namespace kinespace::test
