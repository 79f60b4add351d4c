#include "kinespace/mesh/decimation.h"

#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh/mesh_report.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

MeshSequence refined(const MeshSequence& fine, const Decimation& decimation, int key) {
  const Refinement refinement(frame_points(fine, key), fine.triangles, decimation);
  const MeshSequence coarse = coarse_sequence(fine, decimation);
  MeshSequence out = fine;
  for (int f = 0; f < fine.frames; ++f) set_frame(out, f, refinement.apply(frame_points(coarse, f)));
  return out;
}

TEST(Decimation, keeps_a_subset_that_is_a_sound_mesh_in_every_frame) {
  const MeshSequence mesh = bending_tube(3200, 4, 1.5);
  const Decimation d = decimate(mesh, {.vertices = 800});
  EXPECT_NEAR(static_cast<double>(d.kept.size()), 800, 80);
  const MeshSequence coarse = coarse_sequence(mesh, d);
  EXPECT_NO_THROW(require_valid(coarse, "coarse"));
  const MeshReport r = report(coarse);
  EXPECT_TRUE(r.watertight());
  EXPECT_EQ(r.vertices - r.edges + r.triangles, 2) << "a closed surface as before";
  for (std::size_t i = 0; i < d.kept.size(); ++i) {
    EXPECT_EQ(frame_points(coarse, 3).row(static_cast<Eigen::Index>(i)), frame_points(mesh, 3).row(d.kept[i]));
    if (HasFailure()) return;
  }
}

TEST(Decimation, fine_vertices_come_back_from_coarse_ones) {
  const MeshSequence mesh = bending_tube(3200, 6, 1.5);
  const Decimation d = decimate(mesh, {.vertices = 800, .frame = 3});
  const MeshSequence back = refined(mesh, d, 3);
  EXPECT_LT(compare_positions(mesh, back).kg, 0.3);
  // Exact in the key-frame, and at the vertices that stayed.
  EXPECT_LT((frame_points(mesh, 3) - frame_points(back, 3)).cwiseAbs().maxCoeff(), 1e-6);
  for (const std::int32_t v : d.kept) EXPECT_EQ(frame_points(back, 5).row(v), frame_points(mesh, 5).row(v));
}

TEST(Decimation, a_rigid_motion_comes_back_exactly) {
  MeshSequence mesh = bending_tube(1600, 1, 1.5);
  mesh.frames = 3;
  const std::vector<float> one = mesh.positions;
  for (int f = 1; f < 3; ++f) mesh.positions.insert(mesh.positions.end(), one.begin(), one.end());
  mesh = moved_rigidly(mesh, 0.8);
  const Decimation d = decimate(mesh, {.vertices = 300});
  EXPECT_LT(compare_positions(mesh, refined(mesh, d, 0)).max_vertex_error, 1e-4);
}

TEST(Decimation, several_components_isolated_vertices_and_odd_triangles_are_taken) {
  MeshSequence mesh =
      joined(joined(bending_tube(1600, 2, 1.0), sheet(9, 9, 2)), joined(sheet(2, 2, 2), sheet(1, 1, 2)));
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back(mesh.triangles[5]);
  mesh.triangles.push_back({0, 1, 500});
  const Decimation d = decimate(mesh, {.vertices = 200});
  EXPECT_LT(d.kept.size(), 400U);
  EXPECT_EQ(d.kept.back(), mesh.vertices - 1) << "the isolated vertex stays";
  EXPECT_NO_THROW(require_valid(coarse_sequence(mesh, d), "coarse"));
  EXPECT_NO_THROW(require_valid(refined(mesh, d, 0), "fine"));
  EXPECT_LT(compare_positions(mesh, refined(mesh, d, 0)).kg, 2);
}

TEST(Decimation, fewer_vertices_than_asked_for_all_stay) {
  const MeshSequence mesh = sheet(5, 5, 2);
  const Decimation d = decimate(mesh, {.vertices = 100});
  EXPECT_EQ(d.kept.size(), 25U);
  EXPECT_EQ(d.triangles, mesh.triangles);
}

TEST(Decimation, bad_options_and_bad_lists_are_refused) {
  const MeshSequence mesh = sheet(9, 9, 2);
  EXPECT_THROW((void)decimate(mesh, {.vertices = 3}), Error);
  EXPECT_THROW((void)decimate(mesh, {.vertices = 10, .frame = 2}), Error);
  const Points key = frame_points(mesh, 0);
  Decimation bad = decimate(mesh, {.vertices = 40});
  bad.kept.back() = 81;
  EXPECT_THROW((void)Refinement(key, mesh.triangles, bad), Error);
  bad = decimate(mesh, {.vertices = 40});
  std::swap(bad.kept[0], bad.kept[1]);
  EXPECT_THROW((void)Refinement(key, mesh.triangles, bad), Error);
  bad = decimate(mesh, {.vertices = 40});
  bad.triangles[0][0] = static_cast<std::int32_t>(bad.kept.size());
  EXPECT_THROW((void)Refinement(key, mesh.triangles, bad), Error);
  bad.kept.clear();
  EXPECT_THROW((void)Refinement(key, mesh.triangles, bad), Error);
}

}  // namespace
}  // namespace kinespace::test
