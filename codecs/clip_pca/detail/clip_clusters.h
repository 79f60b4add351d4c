// Vectors in clusters, each with principal components of its own: what clip-pca groups its clips by.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace kinespace {

struct ClusterSpace {
  std::vector<int> members;   // rows, ascending
  Eigen::VectorXd mean;       // [dimension]
  Eigen::MatrixXd axes;       // [dimension][axis], by descending variance, as many as there is variance
  Eigen::VectorXd variances;  // [axis], mean square
  double total_variance = 0;

  // The fewest axes that keep this share of the variance, at least one.
  [[nodiscard]] int axes_for(double share) const;
};

// Rows are vectors. As many clusters as cost least to tell, axes (of `share` of the variance) and coefficients
// together: k-means about the rows' first principal components, from rows far apart. Deterministic.
[[nodiscard]] std::vector<ClusterSpace> cluster_spaces(const Eigen::MatrixXf& rows, double share, int most_clusters);

}  // namespace kinespace
