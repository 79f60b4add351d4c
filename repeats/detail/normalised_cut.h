// Normalised cuts (Shi and Malik 2000): points whose affinities are given, as points of a space in which like points
// are near each other, and clusters of those. Private to this folder. Deterministic.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace kinespace {

// The `count` eigenvectors of D^-1/2 W D^-1/2 with the largest eigenvalues, D the row sums of the symmetric W, as
// columns; by Lanczos with full reorthogonalisation, exact for up to 100 points.
[[nodiscard]] Eigen::MatrixXd normalised_cut_embedding(Eigen::MatrixXf affinities, int count);

// `count` clusters of the rows, normalised to length one: k-means from rows far apart. Returns the cluster of each row;
// clusters may be empty.
[[nodiscard]] std::vector<int> cluster_rows(const Eigen::MatrixXd& rows, int count);

}  // namespace kinespace
