#include "kinespace/mesh/smooth_basis.h"

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/detail/dense_kernels.h"
#include "kinespace/mesh/harmonics.h"
#include "kinespace/mesh/laplacian.h"
#include "kinespace/mesh/sparse_solver.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

double worst_orthonormality(const Eigen::MatrixXd& u) {
  return (u.transpose() * u - Eigen::MatrixXd::Identity(u.cols(), u.cols())).cwiseAbs().maxCoeff();
}

double projection_error(const Eigen::MatrixXd& u, const MeshSequence& mesh) {
  double error = 0;
  for (int f = 0; f < mesh.frames; ++f) {
    const Points x = frame_points(mesh, f);
    error += (x - u * (u.transpose() * x)).squaredNorm();
  }
  return std::sqrt(error);
}

TEST(SmoothBasis, is_orthonormal_and_holds_the_constants) {
  const MeshSequence mesh = joined(bending_tube(1200, 1, 1.5), sheet(9, 8, 1));
  const SmoothBasis basis = smooth_basis(frame_points(mesh, 0), mesh.triangles, {.functions = 75});
  EXPECT_EQ(basis.count(), 75);
  EXPECT_EQ(basis.anchors.size(), 73U);
  EXPECT_LT(worst_orthonormality(basis.functions), 1e-12);
  Eigen::VectorXd one = Eigen::VectorXd::Zero(mesh.vertices);
  one.head(mesh.vertices - 72).setOnes();
  EXPECT_LT((one - basis.functions * (basis.functions.transpose() * one)).norm(), 1e-10);
}

TEST(SmoothBasis, holds_a_moving_mesh_about_as_well_as_its_harmonics) {
  const MeshSequence mesh = bending_tube(2400, 4, 2.0);
  const Points key = frame_points(mesh, 1);
  for (const int functions : {40, 80, 160}) {
    const double smooth = projection_error(smooth_basis(key, mesh.triangles, {.functions = functions}).functions, mesh);
    const double eigen =
        projection_error(manifold_harmonics(key, mesh.triangles, {.functions = functions}).functions, mesh);
    EXPECT_LT(smooth, 1.1 * eigen) << functions;
  }
}

// The rounding of another machine must not be able to turn the basis: a key-frame that moves by 1e-12 must not either.
TEST(SmoothBasis, moves_little_when_the_mesh_does) {
  const MeshSequence mesh = bending_tube(1200, 1, 1.5);
  const Points key = frame_points(mesh, 0);
  const Points nearby = key.array() * (1 + 1e-13) + 1e-13;
  const Eigen::MatrixXd u = smooth_basis(key, mesh.triangles, {.functions = 100}).functions;
  const Eigen::MatrixXd v = smooth_basis(nearby, mesh.triangles, {.functions = 100}).functions;
  EXPECT_LT((u - v).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_EQ(basis_checksum(u), basis_checksum(smooth_basis(key, mesh.triangles, {.functions = 100}).functions));
}

TEST(SmoothBasis, takes_all_functions_there_are_and_strange_meshes) {
  MeshSequence mesh = joined(sheet(5, 5, 1), tetrahedron());
  mesh.vertices += 2;  // isolated, in one place
  for (int c = 0; c < 6; ++c) mesh.positions.push_back(3);
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({0, 1, 12});
  for (const int functions : {1, 2, 3, 4, 5, 20, mesh.vertices}) {
    const SmoothBasis basis = smooth_basis(frame_points(mesh, 0), mesh.triangles, {.functions = functions});
    ASSERT_EQ(basis.count(), functions);
    EXPECT_LT(worst_orthonormality(basis.functions), 1e-9) << functions;
  }
  std::fill(mesh.positions.begin(), mesh.positions.end(), 1.F);  // all in one point
  const SmoothBasis basis = smooth_basis(frame_points(mesh, 0), mesh.triangles, {.functions = 12});
  EXPECT_LT(worst_orthonormality(basis.functions), 1e-9);
}

TEST(SmoothBasis, options_out_of_range_are_refused) {
  const MeshSequence mesh = tetrahedron();
  const Points points = frame_points(mesh, 0);
  for (const SmoothBasisOptions& bad : {SmoothBasisOptions{.functions = 5}, SmoothBasisOptions{.functions = 0},
                                        SmoothBasisOptions{.functions = 2, .order = 0}}) {
    EXPECT_THROW((void)smooth_basis(points, mesh.triangles, bad), Error);
  }
}

TEST(DenseKernels, are_products_for_all_sizes) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const int n : {1, 3, 4, 255, 257}) {
    for (const int p : {1, 3, 5, 8}) {
      for (const int q : {1, 3, 8, 13}) {
        const RowMajor a = RowMajor::Random(n, p), b = RowMajor::Random(n, q);
        RowMajor c(p, q), d = b;
        transposed_product(n, p, q, {a.data(), p}, {b.data(), q}, {c.data(), q});
        EXPECT_LT((c - a.transpose() * b).cwiseAbs().maxCoeff(), 1e-12);
        subtract_product(n, p, q, {a.data(), p}, {c.data(), q}, {d.data(), q});
        EXPECT_LT((d - (b - a * c)).cwiseAbs().maxCoeff(), 1e-11);
      }
    }
  }
}

TEST(SparseSolver, solves_many_right_hand_sides) {
  const MeshSequence mesh = bending_tube(500, 1, 1.0);
  SparseMatrix s = cotangent_stiffness(frame_points(mesh, 0), mesh.triangles);
  for (int v = 0; v < mesh.vertices; ++v) s.coeffRef(v, v) += 0.01;
  const SparseSolver solver(s);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::vector<double> scratch;
  for (const int columns : {1, 3, 8, 12}) {
    const RowMajor x = RowMajor::Random(mesh.vertices, columns);
    RowMajor y = s * x;
    solver.solve(y.data(), columns, scratch);
    EXPECT_LT((x - y).cwiseAbs().maxCoeff(), 1e-10);
  }
  for (int v = 0; v < mesh.vertices; ++v) s.coeffRef(v, v) -= 1;
  EXPECT_THROW(SparseSolver{s}, Error);
}

}  // namespace
}  // namespace kinespace::test
