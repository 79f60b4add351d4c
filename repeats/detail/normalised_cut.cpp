#include "kinespace/repeats/detail/normalised_cut.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "kinespace/base/parallel.h"

namespace kinespace {
namespace {

constexpr int lanczos_steps = 100;
constexpr int means_rounds = 50;

// W x, the rows in parallel: every sum has one order.
Eigen::VectorXd multiply(const Eigen::MatrixXf& w, const Eigen::VectorXd& x) {
  const Eigen::VectorXf xf = x.cast<float>();
  Eigen::VectorXd out(w.cols());
  parallel_for(Eigen::Index{0}, w.cols(), [&](Eigen::Index c) { out(c) = static_cast<double>(w.col(c).dot(xf)); });
  return out;
}

void orthogonalise(Eigen::VectorXd& v, const Eigen::MatrixXd& basis, int count) {
  for (int round = 0; round < 2; ++round) v -= basis.leftCols(count) * (basis.leftCols(count).transpose() * v);
}

// A unit vector orthogonal to the basis; always the same.
Eigen::VectorXd fresh_vector(const Eigen::MatrixXd& basis, int count) {
  for (int attempt = 0;; ++attempt) {
    Eigen::VectorXd v(basis.rows());
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      v(i) = 1 + 0.5 * std::sin(static_cast<double>(i + 1) * (1.7 + static_cast<double>(count + 31 * attempt)));
    }
    v.normalize();
    orthogonalise(v, basis, count);
    if (v.norm() > 1e-6) return v.normalized();
  }
}

struct Lanczos {
  Eigen::MatrixXd basis, tridiagonal;
};

Lanczos lanczos(const Eigen::MatrixXf& w, int steps) {
  Lanczos out{Eigen::MatrixXd::Zero(w.cols(), steps), Eigen::MatrixXd::Zero(steps, steps)};
  out.basis.col(0) = fresh_vector(out.basis, 0);
  for (int s = 0; s < steps; ++s) {
    Eigen::VectorXd next = multiply(w, out.basis.col(s));
    out.tridiagonal(s, s) = next.dot(out.basis.col(s));
    if (s + 1 == steps) break;
    orthogonalise(next, out.basis, s + 1);
    const double beta = next.norm();
    // An invariant space is full: go on in another, with which it has nothing to do.
    const bool exhausted = beta < 1e-5;
    out.basis.col(s + 1) = exhausted ? fresh_vector(out.basis, s + 1) : Eigen::VectorXd(next / beta);
    out.tridiagonal(s + 1, s) = out.tridiagonal(s, s + 1) = exhausted ? 0 : beta;
  }
  return out;
}

// The row farthest from the chosen ones.
Eigen::Index farthest(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& centres, int chosen) {
  Eigen::VectorXd distance = (rows.rowwise() - centres.row(0)).rowwise().squaredNorm();
  for (int c = 1; c < chosen; ++c) {
    distance = distance.cwiseMin((rows.rowwise() - centres.row(c)).rowwise().squaredNorm());
  }
  Eigen::Index out = 0;
  distance.maxCoeff(&out);
  return out;
}

bool assign_rows(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& centres, std::vector<int>& cluster) {
  bool changed = false;
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    Eigen::Index nearest = 0;
    (centres.rowwise() - rows.row(r)).rowwise().squaredNorm().minCoeff(&nearest);
    int& mine = cluster[static_cast<std::size_t>(r)];
    changed |= mine != static_cast<int>(nearest);
    mine = static_cast<int>(nearest);
  }
  return changed;
}

void move_centres(const Eigen::MatrixXd& rows, const std::vector<int>& cluster, Eigen::MatrixXd& centres) {
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(centres.rows(), centres.cols());
  Eigen::VectorXd count = Eigen::VectorXd::Zero(centres.rows());
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    sums.row(cluster[static_cast<std::size_t>(r)]) += rows.row(r);
    count(cluster[static_cast<std::size_t>(r)]) += 1;
  }
  for (Eigen::Index c = 0; c < centres.rows(); ++c) {
    if (count(c) > 0) centres.row(c) = sums.row(c) / count(c);
  }
}

}  // namespace

Eigen::MatrixXd normalised_cut_embedding(Eigen::MatrixXf affinities, int count) {
  const Eigen::VectorXf degree = affinities.rowwise().sum().cwiseMax(1e-6F);
  const Eigen::VectorXf scale = degree.cwiseSqrt().cwiseInverse();
  affinities = scale.asDiagonal() * affinities * scale.asDiagonal();
  const int steps = std::min<int>(lanczos_steps, static_cast<int>(affinities.cols()));
  const Lanczos krylov = lanczos(affinities, steps);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(krylov.tridiagonal);
  return krylov.basis * solver.eigenvectors().rowwise().reverse().leftCols(std::min(count, steps));
}

std::vector<int> cluster_rows(const Eigen::MatrixXd& rows, int count) {
  Eigen::MatrixXd unit = rows;
  for (Eigen::Index r = 0; r < unit.rows(); ++r) unit.row(r) /= std::max(unit.row(r).norm(), 1e-12);
  std::vector<int> cluster(static_cast<std::size_t>(rows.rows()), 0);
  if (count <= 1) return cluster;
  Eigen::MatrixXd centres(count, unit.cols());
  centres.row(0) = unit.row(0);
  for (int c = 1; c < count; ++c) centres.row(c) = unit.row(farthest(unit, centres, c));
  for (int round = 0; round < means_rounds && assign_rows(unit, centres, cluster); ++round) {
    move_centres(unit, cluster, centres);
  }
  return cluster;
}

}  // namespace kinespace
