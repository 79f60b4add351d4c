#include "kinespace/mesh/harmonics.h"

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/detail/eigenpairs.h"
#include "kinespace/mesh/laplacian.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

double worst_orthonormality(const Harmonics& h) {
  const Eigen::MatrixXd gram = h.functions.transpose() * h.mass.asDiagonal() * h.functions;
  return (gram - Eigen::MatrixXd::Identity(h.count(), h.count())).cwiseAbs().maxCoeff();
}

double worst_residual(const Harmonics& h, const SparseMatrix& s) {
  const Eigen::MatrixXd left = s * h.functions;
  const Eigen::MatrixXd right = h.mass.asDiagonal() * h.functions * h.eigenvalues.asDiagonal();
  return (left - right).cwiseAbs().maxCoeff();
}

class HarmonicsOf : public testing::TestWithParam<bool> {};

TEST_P(HarmonicsOf, are_orthonormal_eigenfunctions_smoothest_first) {
  const MeshSequence mesh = bending_tube(1600, 1, 1.5);
  const Points points = frame_points(mesh, 0);
  const Harmonics h = manifold_harmonics(points, mesh.triangles, {.functions = 60, .area_weighted = GetParam()});
  const SparseMatrix s = cotangent_stiffness(points, mesh.triangles);
  EXPECT_LT(worst_orthonormality(h), 1e-9);
  EXPECT_LT(worst_residual(h, s), 1e-7);
  for (int k = 1; k < h.count(); ++k) EXPECT_LE(h.eigenvalues[k - 1], h.eigenvalues[k]);
  EXPECT_LT(h.eigenvalues[0], 1e-9);
  EXPECT_GT(h.eigenvalues[1], 1e-6);
}

TEST_P(HarmonicsOf, are_the_lowest_ones) {
  const MeshSequence mesh = bending_tube(1000, 1, 0.5);
  const Points points = frame_points(mesh, 0);
  const HarmonicsOptions all{.functions = mesh.vertices, .area_weighted = GetParam()};
  const HarmonicsOptions few{.functions = 40, .area_weighted = GetParam()};
  const Harmonics dense = manifold_harmonics(points, mesh.triangles, all);
  const Harmonics sparse = manifold_harmonics(points, mesh.triangles, few);
  EXPECT_LT((dense.eigenvalues.head(40) - sparse.eigenvalues).cwiseAbs().maxCoeff(), 1e-7 * dense.eigenvalues[40]);
}

TEST_P(HarmonicsOf, several_components_have_a_constant_each) {
  const MeshSequence tube = bending_tube(800, 1, 1.0);
  const MeshSequence mesh = joined(joined(tube, tube), tetrahedron());
  MeshSequence lonely = mesh;
  lonely.vertices += 1;
  for (int c = 0; c < 3; ++c) lonely.positions.push_back(7);
  const Points points = frame_points(lonely, 0);
  const Harmonics h = manifold_harmonics(points, lonely.triangles, {.functions = 50, .area_weighted = GetParam()});
  EXPECT_LT(h.eigenvalues[3], 1e-8);
  EXPECT_GT(h.eigenvalues[4], 1e-6);
  EXPECT_LT(worst_orthonormality(h), 1e-9);
  EXPECT_LT(worst_residual(h, cotangent_stiffness(points, lonely.triangles)), 1e-7);
  // The two tubes have their eigenvalues in common.
  EXPECT_NEAR(h.eigenvalues[4], h.eigenvalues[5], 1e-9);
}
INSTANTIATE_TEST_SUITE_P(Masses, HarmonicsOf, testing::Bool(),
                         [](const auto& param) { return param.param ? "areas" : "ones"; });

// A grid of side x side vertices, joined at its borders to a torus: every eigenvalue occurs several times.
std::vector<Triangle> torus(int side) {
  std::vector<Triangle> out;
  const auto at = [&](int i, int j) { return static_cast<std::int32_t>((i % side) * side + j % side); };
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      out.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      out.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return out;
}

TEST(Eigenpairs, of_several_bands_miss_no_copy_of_a_multiple_eigenvalue) {
  constexpr int side = 26, count = 250;
  const SparseMatrix matrix = uniform_stiffness(side * side, torus(side));
  const Eigenpairs dense = smallest_eigenpairs_dense(matrix, count);
  const Eigenpairs bands = smallest_eigenpairs(matrix, count, 1e-9);
  EXPECT_LT((dense.values - bands.values).cwiseAbs().maxCoeff(), 1e-9);
  const Eigen::MatrixXd gram = bands.vectors.transpose() * bands.vectors;
  EXPECT_LT((gram - Eigen::MatrixXd::Identity(count, count)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((matrix * bands.vectors - bands.vectors * bands.values.asDiagonal()).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(Eigenpairs, of_several_bands_are_those_of_a_dense_solver) {
  constexpr int count = 300;
  const MeshSequence mesh = bending_tube(700, 1, 1.2);
  const SparseMatrix matrix = cotangent_stiffness(frame_points(mesh, 0), mesh.triangles);
  const Eigenpairs dense = smallest_eigenpairs_dense(matrix, mesh.vertices);
  for (const int wanted : {1, 2, 30, 59, 61, count}) {
    const Eigenpairs bands = smallest_eigenpairs(matrix, wanted, 1e-9);
    ASSERT_EQ(bands.values.size(), wanted);
    EXPECT_LT((dense.values.head(wanted) - bands.values).cwiseAbs().maxCoeff(), 1e-9) << wanted;
  }
  // Both span the same space, up to the last gap.
  const Eigenpairs bands = smallest_eigenpairs(matrix, count, 1e-9);
  int last = count;
  while (dense.values[last] - dense.values[last - 1] < 1e-6) --last;
  const Eigen::MatrixXd turned = dense.vectors.leftCols(last).transpose() * bands.vectors.leftCols(last);
  EXPECT_LT((turned * turned.transpose() - Eigen::MatrixXd::Identity(last, last)).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(Harmonics, of_a_mesh_without_size_are_some_orthonormal_functions) {
  const MeshSequence mesh = bending_tube(700, 1, 0);
  const Points nothing = Points::Zero(mesh.vertices, 3);
  const Harmonics h = manifold_harmonics(nothing, mesh.triangles, {.functions = 40});
  EXPECT_LT(worst_orthonormality(h), 1e-9);
  EXPECT_LT(h.eigenvalues.maxCoeff(), 1e-9);
}

TEST(Harmonics, come_out_the_same_every_time) {
  const MeshSequence mesh = bending_tube(1200, 1, 1.5);
  const Points points = frame_points(mesh, 0);
  const auto once = basis_checksum(manifold_harmonics(points, mesh.triangles, {.functions = 50}).functions);
  EXPECT_EQ(once, basis_checksum(manifold_harmonics(points, mesh.triangles, {.functions = 50}).functions));
  EXPECT_NE(once, basis_checksum(manifold_harmonics(points, mesh.triangles, {.functions = 49}).functions));
}

TEST(Harmonics, more_functions_than_vertices_are_an_error) {
  const MeshSequence mesh = tetrahedron();
  const Points points = frame_points(mesh, 0);
  EXPECT_EQ(manifold_harmonics(points, mesh.triangles, {.functions = 4}).count(), 4);
  for (const int functions : {5, 0, -1}) {
    try {
      (void)manifold_harmonics(points, mesh.triangles, {.functions = functions});
      FAIL() << functions;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      EXPECT_EQ(error.details().expected, "1 to 4, the number of vertices");
    }
  }
}

}  // namespace
}  // namespace kinespace::test
