#include "kinespace/mesh/laplacian.h"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

Eigen::MatrixXd dense(const SparseMatrix& matrix) {
  return Eigen::MatrixXd(matrix);
}

TEST(Laplacian, tetrahedron_is_as_computed_by_hand) {
  const MeshSequence mesh = tetrahedron();
  // At an edge of the corner two right-angled triangles show 45 degrees: cot 1 each. At a slanted edge one right angle
  // (cot 0) and one of 60 degrees (cot 1/sqrt 3).
  const double corner = 0.5 * (1 + 1), slanted = 0.5 / std::sqrt(3.0);
  Eigen::MatrixXd expected(4, 4);
  expected << 3 * corner, -corner, -corner, -corner,      //
      -corner, corner + 2 * slanted, -slanted, -slanted,  //
      -corner, -slanted, corner + 2 * slanted, -slanted,  //
      -corner, -slanted, -slanted, corner + 2 * slanted;
  EXPECT_LT((dense(cotangent_stiffness(frame_points(mesh, 0), mesh.triangles)) - expected).cwiseAbs().maxCoeff(),
            1e-12);
  const double faces = 0.5, front = std::sqrt(3.0) / 2;
  const Eigen::VectorXd mass = lumped_mass(frame_points(mesh, 0), mesh.triangles);
  EXPECT_NEAR(mass[0], 3 * faces / 3, 1e-12);
  EXPECT_NEAR(mass[1], (2 * faces + front) / 3, 1e-12);
}

TEST(Laplacian, is_symmetric_semidefinite_and_constants_are_its_null_space) {
  const MeshSequence mesh = joined(bending_tube(160, 1, 1.5), sheet(6, 5, 1));
  for (const SparseMatrix& s :
       {cotangent_stiffness(frame_points(mesh, 0), mesh.triangles), uniform_stiffness(mesh.vertices, mesh.triangles)}) {
    const Eigen::MatrixXd full = dense(s);
    EXPECT_LT((full - full.transpose()).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_LT((full * Eigen::VectorXd::Ones(mesh.vertices)).cwiseAbs().maxCoeff(), 1e-12);
    const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(full).eigenvalues();
    EXPECT_LT(values.head(2).cwiseAbs().maxCoeff(), 1e-12) << "one for each component";
    EXPECT_GT(values[2], 1e-4) << "and no more";
  }
}

TEST(Laplacian, linear_functions_are_harmonic_inside_a_flat_sheet) {
  MeshSequence mesh = sheet(6, 6, 1);
  for (std::size_t i = 2; i < mesh.positions.size(); i += 3) mesh.positions[i] = 0;
  const Points points = frame_points(mesh, 0);
  const Points image = cotangent_stiffness(points, mesh.triangles) * points;
  for (int y = 1; y < 5; ++y) {
    for (int x = 1; x < 5; ++x) EXPECT_LT(image.row(y * 6 + x).norm(), 1e-12);
  }
}

TEST(Laplacian, flat_and_collapsed_triangles_keep_it_finite_and_semidefinite) {
  MeshSequence mesh = sheet(5, 5, 1);
  for (const int v : {6, 7, 8, 12}) {
    for (int c = 0; c < 3; ++c) mesh.positions[static_cast<std::size_t>(3 * v + c)] = static_cast<float>(c);
  }
  for (int c = 0; c < 3; ++c) mesh.positions[static_cast<std::size_t>(c)] = 1e-9F * static_cast<float>(c);
  mesh.triangles.push_back({3, 3, 4});
  const Eigen::MatrixXd s = dense(cotangent_stiffness(frame_points(mesh, 0), mesh.triangles));
  EXPECT_TRUE(s.allFinite());
  EXPECT_LE(s.cwiseAbs().maxCoeff(), 25 / cotangent_flatness);
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(s).eigenvalues();
  EXPECT_GT(values[0], -1e-9 * values[24]);
  EXPECT_GT(lumped_mass(frame_points(mesh, 0), mesh.triangles).minCoeff(), 0);
}

}  // namespace
}  // namespace kinespace::test
