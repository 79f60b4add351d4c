#include "kinespace/mesh/deformation.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "kinespace/mesh/harmonics.h"
#include "kinespace/mesh/laplacian.h"
#include "kinespace/mesh/smooth_basis.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

TEST(DeformationGradient, is_the_map_of_a_moved_triangle) {
  Corners from, to;
  from << 0, 1, 0.2, 0, 0.1, 1, 0, 0.3, 0.4;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -1, 2).normalized()).toRotationMatrix();
  EXPECT_LT((deformation_gradient(from, (turn * from).colwise() + Eigen::Vector3d(3, 4, 5)) - turn).norm(), 1e-12);
  EXPECT_LT((deformation_gradient(from, 2 * from) - 2 * Eigen::Matrix3d::Identity()).norm(), 1e-12);
  // Edges go where they went, whatever the deformation.
  to << 0, 2, 0.1, 0, 0.5, 1, 1, 0.3, 0.7;
  const Eigen::Matrix3d s = deformation_gradient(from, to);
  EXPECT_LT((s * (from.col(1) - from.col(0)) - (to.col(1) - to.col(0))).norm(), 1e-12);
  EXPECT_LT((s * (from.col(2) - from.col(0)) - (to.col(2) - to.col(0))).norm(), 1e-12);
  from.col(2) = from.col(1);
  EXPECT_TRUE(deformation_gradient(from, to).allFinite());
}

class Transfer : public testing::TestWithParam<TransferMethod> {};

TEST_P(Transfer, carries_a_rigid_motion_exactly) {
  const MeshSequence mesh = joined(bending_tube(600, 1, 1.5), sheet(7, 6, 1));
  const Points key = frame_points(mesh, 0);
  const Projection space(smooth_basis(key, mesh.triangles, {.functions = 40}).functions);
  const Points low = space.synthesise(space.coefficients(key));
  ASSERT_GT((key - low).norm(), 0.1) << "there are details to carry";
  const DetailTransfer transfer(key, low, mesh.triangles, GetParam());
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.0, Eigen::Vector3d(3, -1, 2).normalized()).toRotationMatrix();
  const auto moved = [&](const Points& x) {
    return Points((x * turn.transpose()).rowwise() + Eigen::RowVector3d(10, -3, 2));
  };
  EXPECT_LT((transfer.apply(low) - key).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_LT((transfer.apply(moved(low)) - moved(key)).cwiseAbs().maxCoeff(), 1e-7);
  const Coefficients c = space.coefficients(moved(key));
  const Points corrected = correct_low_frequencies(transfer.apply(space.synthesise(c)), c, space);
  EXPECT_LT((corrected - moved(key)).cwiseAbs().maxCoeff(), 1e-5);
}

TEST_P(Transfer, brings_a_bent_mesh_closer_than_its_low_frequencies) {
  const MeshSequence mesh = bending_tube(1600, 6, 2.0);
  const Points key = frame_points(mesh, 3);
  const Projection space(smooth_basis(key, mesh.triangles, {.functions = 60}).functions);
  const DetailTransfer transfer(key, space.synthesise(space.coefficients(key)), mesh.triangles, GetParam());
  double plain = 0, transferred = 0, corrected = 0;
  for (int f = 0; f < mesh.frames; ++f) {
    const Points x = frame_points(mesh, f);
    const Coefficients c = space.coefficients(x);
    const Points low = space.synthesise(c), with = transfer.apply(low);
    plain += (low - x).squaredNorm();
    transferred += (with - x).squaredNorm();
    corrected += (correct_low_frequencies(with, c, space) - x).squaredNorm();
  }
  EXPECT_LT(transferred, 0.25 * plain);
  EXPECT_LT(corrected, transferred) << "the correction removes an orthogonal part of the error";
}

TEST_P(Transfer, degenerate_low_frequency_triangles_stay_finite) {
  MeshSequence mesh = sheet(8, 8, 2);
  mesh.vertices += 1;  // an isolated vertex
  std::vector<float> positions;
  for (int f = 0; f < 2; ++f) {
    const auto frame = std::span(mesh.positions).subspan(static_cast<std::size_t>(f) * 192, 192);
    positions.insert(positions.end(), frame.begin(), frame.end());
    positions.insert(positions.end(), {1, 2, 3});
  }
  mesh.positions = positions;
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({0, 1, 2});
  const Points key = frame_points(mesh, 0);
  Points low = key;
  for (int v = 9; v < 30; ++v) low.row(v) = low.row(9);
  const Points other = frame_points(mesh, 1);
  Points other_low = other;
  for (int v = 9; v < 30; ++v) other_low.row(v) = 0.3 * other.row(9) + 1e-9 * other.row(v);
  const DetailTransfer transfer(key, low, mesh.triangles, GetParam());
  EXPECT_LT(transfer.apply(other_low).cwiseAbs().maxCoeff(), 100);
  const DetailTransfer all_flat(key, Points::Zero(key.rows(), 3), mesh.triangles, GetParam());
  EXPECT_TRUE(all_flat.apply(other_low).allFinite());
}
INSTANTIATE_TEST_SUITE_P(Methods, Transfer, testing::Values(TransferMethod::poisson, TransferMethod::rotations),
                         [](const auto& param) {
                           return param.param == TransferMethod::poisson ? "poisson" : "rotations";
                         });

TEST(Projection, coefficients_are_least_squares_for_any_functions) {
  const MeshSequence mesh = bending_tube(700, 1, 1.0);
  const Points key = frame_points(mesh, 0);
  const Harmonics weighted = manifold_harmonics(key, mesh.triangles, {.functions = 30, .area_weighted = true});
  const Projection space(weighted.functions);
  const Points x = Points::Random(mesh.vertices, 3);
  const Points rest = x - space.synthesise(space.coefficients(x));
  EXPECT_LT((weighted.functions.transpose() * rest).cwiseAbs().maxCoeff(), 1e-5);
  const Points inside = space.synthesise(Coefficients::Random(30, 3));
  EXPECT_LT((space.synthesise(space.coefficients(inside)) - inside).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(Projection, first_functions_alone_may_be_used) {
  const MeshSequence mesh = bending_tube(700, 1, 1.0);
  const Projection space(smooth_basis(frame_points(mesh, 0), mesh.triangles, {.functions = 30}).functions);
  Coefficients c = Coefficients::Random(30, 3);
  c.bottomRows(20).setZero();
  EXPECT_EQ(space.synthesise(c), space.synthesise(c.topRows(10)));
}

}  // namespace
}  // namespace kinespace::test
