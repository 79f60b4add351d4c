#include "kinespace/synthesis/motion_map.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "kinespace/fpca/symmetric_eigen.h"

namespace kinespace {
namespace {

constexpr int map_axes = 2;

Eigen::MatrixXd centred(const RetrievalMatrix& vectors) {
  const auto clips = static_cast<Eigen::Index>(vectors.clip_ids.size());
  const auto dimensions = static_cast<Eigen::Index>(vectors.dimensions);
  using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::MatrixXd out = Eigen::Map<const Rows>(vectors.values.data(), clips, dimensions).cast<double>();
  out.rowwise() -= out.colwise().mean().eval();
  return out;
}

// Unit vectors along which the rows spread most, as columns, and their eigenvalues over the sum of all.
struct PrincipalAxes {
  Eigen::MatrixXd directions;
  std::array<double, map_axes> shares{};
};

PrincipalAxes principal_axes(const Eigen::MatrixXd& rows) {
  PrincipalAxes out;
  const bool by_clips = rows.rows() < rows.cols();  // the smaller of X X' and X' X, which have the same eigenvalues
  Eigen::MatrixXd products(std::min(rows.rows(), rows.cols()), std::min(rows.rows(), rows.cols()));
  if (by_clips) {
    products.noalias() = rows * rows.transpose();
  } else {
    products.noalias() = rows.transpose() * rows;
  }
  SymmetricEigen eigen;
  const Eigen::VectorXd values = eigen.decompose(products);
  const int count = static_cast<int>(std::min<Eigen::Index>(map_axes, values.size()));
  out.directions = eigen.vectors(count);
  if (by_clips) out.directions = (rows.transpose() * out.directions).eval();
  const double all = values.cwiseMax(0.0).sum();
  for (int axis = 0; axis < count; ++axis) {
    auto direction = out.directions.col(axis);
    const double length = direction.norm();
    // Along an axis on which the clips do not differ there is nothing but rounding.
    if (!(values(axis) > 1e-12 * all) || !(length > 0)) {
      direction.setZero();
      continue;
    }
    Eigen::Index largest = 0;
    direction.cwiseAbs().maxCoeff(&largest);
    direction *= (direction(largest) < 0 ? -1 : 1) / length;
    out.shares[static_cast<std::size_t>(axis)] = values(axis) / all;
  }
  return out;
}

}  // namespace

MotionMap motion_map(const RetrievalMatrix& vectors) {
  MotionMap out;
  for (const std::int64_t id : vectors.clip_ids) out.points.push_back({.clip_id = id});
  if (out.points.empty() || vectors.dimensions == 0) return out;
  const Eigen::MatrixXd rows = centred(vectors);
  const PrincipalAxes axes = principal_axes(rows);
  const Eigen::MatrixXd places = rows * axes.directions;
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    out.points[i].x = places(row, 0);
    if (places.cols() > 1) out.points[i].y = places(row, 1);
  }
  out.shares = axes.shares;
  return out;
}

}  // namespace kinespace
