#include "kinespace/mesh/rigid.h"

#include <random>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/detail/rotation_fit.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

Eigen::Matrix3d by_svd(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, 1);
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) sign[2] = -1;
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

Eigen::Matrix3d any_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
      .normalized()
      .toRotationMatrix();
}

TEST(NearestRotation, is_that_of_the_singular_value_decomposition) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 2000; ++i) {
    Eigen::Matrix3d m;
    for (double& x : m.reshaped()) x = normal(random) * 1e-3;
    const Eigen::Matrix3d r = nearest_rotation(m), s = by_svd(m);
    EXPECT_LT((r.transpose() * r - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_GT(r.determinant(), 0.99);
    const Eigen::Vector3d d = Eigen::JacobiSVD<Eigen::Matrix3d>(m).singularValues();
    const double gap = d[1] + (m.determinant() < 0 ? -d[2] : d[2]);  // to the second best rotation
    if (gap > 0.01 * m.norm()) {
      EXPECT_LT((r - s).norm(), 1e-6) << m;
    }
  }
}

TEST(NearestRotation, finds_rotations_of_flat_and_of_full_neighbourhoods) {
  std::mt19937 random(2);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Matrix3d r = any_rotation(random);
    EXPECT_LT((nearest_rotation(r) - r).norm(), 1e-8);
    EXPECT_LT((nearest_rotation(r * Eigen::Vector3d(3, 1, 0).asDiagonal()) - r).norm(), 1e-8) << "rank 2";
    EXPECT_LT((nearest_rotation(r * Eigen::Vector3d(5, 1e-3, 1e-4).asDiagonal()) - r).norm(), 1e-5);
  }
}

TEST(NearestRotation, is_a_rotation_for_every_matrix) {
  std::mt19937 random(3);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Matrix3d r = any_rotation(random);
    for (const Eigen::Vector3d& d : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(1, 1, -1), Eigen::Vector3d(-1, -1, -1),
                                     Eigen::Vector3d(2, 1, -1), Eigen::Vector3d(1e-200, 1e-200, 0)}) {
      const Eigen::Matrix3d m = r * d.asDiagonal() * any_rotation(random).transpose();
      const Eigen::Matrix3d q = nearest_rotation(m);
      EXPECT_LT((q.transpose() * q - Eigen::Matrix3d::Identity()).norm(), 1e-9);
      EXPECT_GT(q.determinant(), 0.99);
      EXPECT_GE((q.transpose() * m).trace(), (by_svd(m).transpose() * m).trace() - 1e-4 * d.norm() - 1e-150);
    }
  }
  EXPECT_EQ(nearest_rotation(Eigen::Matrix3d::Zero()), Eigen::Matrix3d::Identity());
}

TEST(RigidMotion, is_found_and_undone) {
  MeshSequence mesh = bending_tube(300, 1, 1.0);
  mesh.frames = 5;
  const std::vector<float> one = mesh.positions;
  for (int f = 1; f < 5; ++f) mesh.positions.insert(mesh.positions.end(), one.begin(), one.end());
  mesh = moved_rigidly(mesh, 0.9);
  const auto motions = rigid_motions(mesh);
  EXPECT_EQ(motions[0].rotation, Eigen::Matrix3d::Identity());
  const Points reference = frame_points(mesh, 0);
  for (int f = 0; f < 5; ++f) {
    const Points x = frame_points(mesh, f);
    const RigidMotion& m = motions[static_cast<std::size_t>(f)];
    EXPECT_LT((m.apply(reference) - x).cwiseAbs().maxCoeff(), 1e-5) << f;
    EXPECT_LT((m.apply(m.undo(x)) - x).cwiseAbs().maxCoeff(), 1e-12) << f;
  }
}

TEST(RigidMotion, rotations_survive_as_three_numbers) {
  std::mt19937 random(4);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Matrix3d r = any_rotation(random);
    EXPECT_LT((rotation_of(rotation_numbers(r)) - r).norm(), 1e-7);
  }
  for (const Eigen::Vector3d& d :
       {Eigen::Vector3d(1, -1, -1), Eigen::Vector3d(-1, 1, -1), Eigen::Vector3d(-1, -1, 1)}) {
    const Eigen::Matrix3d half_turn = d.asDiagonal();
    EXPECT_LT((rotation_of(rotation_numbers(half_turn)) - half_turn).norm(), 1e-12);
  }
  const Eigen::Matrix3d damaged = rotation_of({5, -7, 2});
  EXPECT_LT((damaged.transpose() * damaged - Eigen::Matrix3d::Identity()).norm(), 1e-12);
}

MeshSequence three_poses() {
  // Frames 0-3 straight, 4-8 bent, 9-11 bent more, each also carried about.
  MeshSequence out = bending_tube(200, 1, 0.01);
  const MeshSequence poses = bending_tube(200, 3, 2.4);
  out.positions.clear();
  out.frames = 12;
  for (int f = 0; f < 12; ++f) {
    const auto pose = poses.frame(f < 4 ? 0 : f < 9 ? 1 : 2);
    out.positions.insert(out.positions.end(), pose.begin(), pose.end());
    out.positions[static_cast<std::size_t>(f) * out.frame_size()] += 0.01F * static_cast<float>(f);
  }
  return moved_rigidly(out, 0.4);
}

TEST(Clusters, group_frames_by_pose_whatever_the_rigid_motion) {
  const Clusters found = cluster_frames(three_poses(), {.clusters = 3});
  EXPECT_EQ(found.of, (std::vector<std::int32_t>{0, 0, 0, 0, 1, 1, 1, 1, 1, 2, 2, 2}));
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(found.of[static_cast<std::size_t>(found.medoid[k])], static_cast<std::int32_t>(k));
  }
}

TEST(Clusters, cost_falls_with_their_number_and_seeds_repeat) {
  const MeshSequence mesh = bending_tube(200, 10, 2.0);
  double before = std::numeric_limits<double>::infinity();
  for (int k = 1; k <= 10; ++k) {
    const Clusters found = cluster_frames(mesh, {.clusters = k, .seed = 7});
    EXPECT_LT(found.cost, before);
    before = found.cost;
    EXPECT_EQ(found.of, cluster_frames(mesh, {.clusters = k, .seed = 7}).of);
  }
  EXPECT_EQ(before, 0) << "every frame its own medoid";
}

TEST(Clusters, are_the_best_of_all_for_small_cases) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform;
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::Matrix<double, 9, 2> p;
    for (double& x : p.reshaped()) x = uniform(random);
    Eigen::MatrixXd d(9, 9);
    for (int i = 0; i < 9; ++i) {
      for (int j = 0; j < 9; ++j) d(i, j) = (p.row(i) - p.row(j)).cwiseAbs().sum();
    }
    double best = 1e9;
    for (int a = 0; a < 9; ++a) {
      for (int b = a + 1; b < 9; ++b) best = std::min(best, d.col(a).cwiseMin(d.col(b)).sum());
    }
    EXPECT_NEAR(cluster(d, {.clusters = 2, .starts = 40}).cost, best, 1e-12);
  }
}

TEST(Clusters, options_out_of_range_are_refused) {
  const MeshSequence mesh = sheet(3, 3, 4);
  EXPECT_THROW((void)cluster_frames(mesh, {.clusters = 5}), Error);
  EXPECT_THROW((void)cluster_frames(mesh, {.clusters = 0}), Error);
  EXPECT_THROW((void)cluster_frames(mesh, {.clusters = 2, .starts = -1}), Error);
  MeshSequence still = sheet(3, 3, 1);
  still.frames = 3;
  const std::vector<float> one = still.positions;
  for (int f = 1; f < 3; ++f) still.positions.insert(still.positions.end(), one.begin(), one.end());
  EXPECT_EQ(cluster_frames(still, {.clusters = 3}).medoid, (std::vector<std::int32_t>{0, 1, 2}));
}

}  // namespace
}  // namespace kinespace::test
