// Rigid motion of whole frames, and frames of similar pose.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

// x = rotation * y + translation.
struct RigidMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  [[nodiscard]] Points apply(const Points& y) const;
  [[nodiscard]] Points undo(const Points& x) const;
};

// The motion that takes `from` closest to `to`, least squares over the vertices (chen2019 eq. 1; besl and mckay 1992).
[[nodiscard]] RigidMotion rigid_motion(const Points& from, const Points& to);

// The motion of every frame: frame f is about motion[f].apply(reference frame). Frame `reference` gets the identity.
[[nodiscard]] std::vector<RigidMotion> rigid_motions(const MeshSequence& mesh, int reference = 0);

// A rotation as three numbers, x, y and z of its unit quaternion with w >= 0, and back; w = sqrt(1 - x^2 - y^2 - z^2),
// and three numbers too long for that are scaled. Sums, products and roots only: the same bits everywhere.
[[nodiscard]] Eigen::Vector3d rotation_numbers(const Eigen::Matrix3d& rotation);
[[nodiscard]] Eigen::Matrix3d rotation_of(const Eigen::Vector3d& numbers);

// K-medoids with the L1 distance of positions (chen2019 section 3.1.2, eq. 2).
struct ClusterOptions {
  int clusters = 1;        // 1 to the number of frames
  std::uint64_t seed = 1;  // of the random starts
  int starts = 8;          // besides a greedy one; 0 to 1000

  // Throws Error{usage} naming field, value and legal range.
  void validate(int frames) const;
};
struct Clusters {
  std::vector<std::int32_t> medoid;  // the frame at the heart of each cluster, ascending
  std::vector<std::int32_t> of;      // the cluster of each frame
  double cost = 0;                   // sum over frames of the distance to their medoid
};

// L1 distances of positions after the frames' rigid motion against frame 0 was undone. Time grows with frames^2 *
// vertices: 250 frames of 10 000 vertices take under a second.
[[nodiscard]] Eigen::MatrixXd frame_distances(const MeshSequence& mesh);

// Clusters by frame_distances. Medoids and members are found in turns (voronoi iteration) from a greedy start and from
// `starts` random ones; the cheapest result wins, the first of equal ones. The same options give the same result
// everywhere.
[[nodiscard]] Clusters cluster_frames(const MeshSequence& mesh, const ClusterOptions& options);

// The same for a symmetric matrix of distances.
[[nodiscard]] Clusters cluster(const Eigen::MatrixXd& distances, const ClusterOptions& options);

}  // namespace kinespace
