// What the parts of mesh/ promise, on the sequences of the shared data.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/mesh/decimation.h"
#include "kinespace/mesh/deformation.h"
#include "kinespace/mesh/harmonics.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh/mesh_files.h"
#include "kinespace/mesh/mesh_report.h"
#include "kinespace/mesh/picture.h"
#include "kinespace/mesh/rigid.h"
#include "kinespace/mesh/smooth_basis.h"
#include "tests/mesh/sample_meshes.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

double kg_of(const MeshSequence& mesh, const Projection& space, const DetailTransfer* transfer, bool correct) {
  MeshSequence decoded = mesh;
  for (int f = 0; f < mesh.frames; ++f) {
    const Coefficients c = space.coefficients(frame_points(mesh, f));
    Points x = space.synthesise(c);
    if (transfer != nullptr) x = transfer->apply(x);
    set_frame(decoded, f, correct ? correct_low_frequencies(x, c, space) : x);
  }
  return compare_positions(mesh, decoded).kg;
}

// Every n-th frame.
MeshSequence thinned(const MeshSequence& mesh, int n) {
  MeshSequence out = mesh;
  out.positions.clear();
  out.frames = 0;
  for (int f = 0; f < mesh.frames; f += n, ++out.frames) {
    out.positions.insert(out.positions.end(), mesh.frame(f).begin(), mesh.frame(f).end());
  }
  return out;
}

TEST(MeshData, sequences_are_what_their_readme_says) {
  KINESPACE_REQUIRE_FOLDER(folder, mesh_folder);
  const MeshReport horse = report(read_mesh_sequence(folder / "horse-gallop"));
  EXPECT_EQ(horse.vertices, 8431);
  EXPECT_EQ(horse.triangles, 16843);
  EXPECT_EQ(horse.frames, 48);
  EXPECT_EQ(horse.boundary_edges, 19);
  EXPECT_EQ(horse.components, 1);
  EXPECT_EQ(horse.isolated_vertices, 0);
  EXPECT_EQ(report(read_mesh_sequence(folder / "cloth")).boundary_edges, 296);
  EXPECT_TRUE(report(read_mesh_sequence(folder / "samba")).watertight());
}

TEST(MeshData, smooth_basis_holds_sequences_as_well_as_harmonics) {
  KINESPACE_REQUIRE_FOLDER(folder, mesh_folder);
  for (const auto& [name, step] : {std::pair{"horse-gallop", 4}, std::pair{"samba", 20}, std::pair{"cloth", 20}}) {
    const MeshSequence mesh = thinned(read_mesh_sequence(folder / name), step);
    const Points key = frame_points(mesh, mesh.frames / 2);
    const Projection smooth(smooth_basis(key, mesh.triangles, {.functions = 150}).functions);
    const Projection harmonics(manifold_harmonics(key, mesh.triangles, {.functions = 150}).functions);
    EXPECT_LT(kg_of(mesh, smooth, nullptr, false), 1.03 * kg_of(mesh, harmonics, nullptr, false)) << name;
  }
}

TEST(MeshData, details_bring_articulated_motion_closer) {
  KINESPACE_REQUIRE_FOLDER(folder, mesh_folder);
  for (const auto& [name, step] : {std::pair{"horse-gallop", 4}, std::pair{"samba", 20}}) {
    const MeshSequence mesh = thinned(read_mesh_sequence(folder / name), step);
    const Points key = frame_points(mesh, cluster_frames(mesh, {.clusters = 1}).medoid[0]);
    const Projection space(smooth_basis(key, mesh.triangles, {.functions = 200}).functions);
    const Points low = space.synthesise(space.coefficients(key));
    const DetailTransfer rotations(key, low, mesh.triangles, TransferMethod::rotations);
    const DetailTransfer poisson(key, low, mesh.triangles, TransferMethod::poisson);
    const double plain = kg_of(mesh, space, nullptr, false);
    EXPECT_LT(kg_of(mesh, space, &rotations, false), 0.8 * plain) << name;
    EXPECT_LT(kg_of(mesh, space, &rotations, true), kg_of(mesh, space, &rotations, false)) << name;
    EXPECT_LT(kg_of(mesh, space, &poisson, true), 0.8 * plain) << name;
  }
}

// Where low-pass triangles degenerate (hooves), more functions must not make the result worse.
TEST(MeshData, more_functions_never_hurt) {
  KINESPACE_REQUIRE_FOLDER(folder, mesh_folder);
  const MeshSequence mesh = thinned(read_mesh_sequence(folder / "horse-gallop"), 6);
  const Points key = frame_points(mesh, mesh.frames / 2);
  for (const TransferMethod method : {TransferMethod::rotations, TransferMethod::poisson}) {
    double before = std::numeric_limits<double>::infinity();
    for (const int functions : {75, 150, 300}) {
      const Projection space(smooth_basis(key, mesh.triangles, {.functions = functions}).functions);
      const DetailTransfer transfer(key, space.synthesise(space.coefficients(key)), mesh.triangles, method);
      const double now = kg_of(mesh, space, &transfer, true);
      EXPECT_LT(now, before) << functions;
      before = now;
    }
  }
}

TEST(MeshData, elephant_comes_back_from_a_quarter_of_its_vertices) {
  KINESPACE_REQUIRE_FOLDER(folder, mesh_folder);
  const MeshSequence mesh = thinned(read_mesh_sequence(folder / "elephant-gallop"), 6);
  const Decimation decimation = decimate(mesh);
  EXPECT_NEAR(static_cast<double>(decimation.kept.size()), 10'000, 200);
  const Refinement refinement(frame_points(mesh, mesh.frames / 2), mesh.triangles, decimation);
  const MeshSequence coarse = coarse_sequence(mesh, decimation);
  MeshSequence back = mesh;
  for (int f = 0; f < mesh.frames; ++f) set_frame(back, f, refinement.apply(frame_points(coarse, f)));
  EXPECT_LT(compare_positions(mesh, back).kg, 0.2);
}

TEST(MeshData, a_picture_of_the_horse_shows_it_three_times) {
  KINESPACE_REQUIRE_FOLDER(folder, mesh_folder);
  const MeshSequence mesh = read_mesh_sequence(folder / "horse-gallop");
  const Picture picture =
      draw_comparison(mesh, mesh, 5, PictureError::distance, {.panel_width = 200, .panel_height = 200}).picture;
  for (int panel = 0; panel < 3; ++panel) {
    int drawn = 0;
    for (int y = 0; y < 200; ++y) {
      for (int x = 0; x < 200; ++x) drawn += picture.at(200 * panel + x, y)[0] < 250 ? 1 : 0;
    }
    EXPECT_GT(drawn, 8000) << panel;
    EXPECT_LT(drawn, 24000) << panel;
  }
}

}  // namespace
}  // namespace kinespace::test
