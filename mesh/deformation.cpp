#include "kinespace/mesh/deformation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "kinespace/mesh/detail/rotation_fit.h"
#include "kinespace/mesh/laplacian.h"

namespace kinespace {
namespace {

// A triangle is degenerate when its doubled area is below this times its longest edge squared: 0.6 degrees.
constexpr double degenerate_below = 0.01;
// Nor may a gradient stretch more than this: low-frequency triangles that nearly vanish tell nothing.
constexpr double most_stretch = 4;

Corners corners(const Points& points, const Triangle& t) {
  Corners out;
  for (int k = 0; k < 3; ++k) {
    for (int c = 0; c < 3; ++c) out(c, k) = points(t[static_cast<std::size_t>(k)], c);
  }
  return out;
}

double longest_edge_squared(const Corners& t) {
  return std::max(
      {(t.col(1) - t.col(0)).squaredNorm(), (t.col(2) - t.col(1)).squaredNorm(), (t.col(0) - t.col(2)).squaredNorm()});
}

Eigen::Vector3d doubled_area_vector(const Corners& t) {
  return (t.col(1) - t.col(0)).cross(t.col(2) - t.col(0));
}

bool degenerate_corners(const Corners& t) {
  return !(doubled_area_vector(t).norm() > degenerate_below * longest_edge_squared(t));
}

// Edges and the normal of length sqrt(doubled area).
Eigen::Matrix3d frame_of(const Corners& t) {
  Eigen::Matrix3d out;
  const Eigen::Vector3d n = doubled_area_vector(t);
  const double length = n.norm();
  out.col(0) = t.col(1) - t.col(0);
  out.col(1) = t.col(2) - t.col(0);
  out.col(2) = length > 0 ? Eigen::Vector3d(n / std::sqrt(length)) : Eigen::Vector3d(Eigen::Vector3d::Zero());
  return out;
}

Eigen::Matrix3d ring_rotation(const Neighbours& neighbours, const Points& from, const Points& to, int i) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  const Eigen::Vector3d a(from(i, 0), from(i, 1), from(i, 2)), b(to(i, 0), to(i, 1), to(i, 2));
  for (const std::int32_t j : neighbours.of(i)) {
    const Eigen::Vector3d p = Eigen::Vector3d(from(j, 0), from(j, 1), from(j, 2)) - a;
    const Eigen::Vector3d q = Eigen::Vector3d(to(j, 0), to(j, 1), to(j, 2)) - b;
    m += q * p.transpose();
  }
  return nearest_rotation(m);
}

// S + a weight that pins one vertex of each component.
SparseMatrix pinned(SparseMatrix stiffness, const Components& components) {
  double trace = 0;
  for (Eigen::Index v = 0; v < stiffness.rows(); ++v) trace += stiffness.coeff(v, v);
  const double mean = trace > 0 ? trace / static_cast<double>(stiffness.rows()) : 1;
  for (const std::int32_t v : components.first_vertex) stiffness.coeffRef(v, v) += mean;
  // What collapsed triangles leave loose.
  for (Eigen::Index v = 0; v < stiffness.rows(); ++v) stiffness.coeffRef(v, v) += 1e-12 * mean;
  return stiffness;
}

}  // namespace

Eigen::Matrix3d deformation_gradient(const Corners& from, const Corners& to) {
  const Eigen::Matrix3d a = frame_of(from);
  const double volume = a.determinant();
  if (!(std::abs(volume) > 0)) return Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d out = frame_of(to) * a.inverse();
  return out.allFinite() ? out : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
}

std::vector<Eigen::Matrix3d> ring_rotations(const Neighbours& neighbours, const Points& from, const Points& to) {
  std::vector<Eigen::Matrix3d> out(static_cast<std::size_t>(neighbours.vertices()));
  for (int v = 0; v < neighbours.vertices(); ++v) {
    out[static_cast<std::size_t>(v)] = ring_rotation(neighbours, from, to, v);
  }
  return out;
}

DetailTransfer::DetailTransfer(Points key, Points key_low, std::span<const Triangle> triangles, TransferMethod method)
    : key_(std::move(key)),
      key_low_(std::move(key_low)),
      detail_(key_ - key_low_),
      triangles_(triangles.begin(), triangles.end()),
      method_(method),
      neighbours_(static_cast<int>(key_.rows()), triangles) {
  if (method_ == TransferMethod::poisson) prepare_poisson();
}

void DetailTransfer::prepare_poisson() {
  components_ = connected_components(neighbours_);
  solver_ = std::make_unique<SparseSolver>(pinned(cotangent_stiffness(key_, triangles_), components_));
  elements_.reserve(triangles_.size());
  for (const Triangle& t : triangles_) {
    const Corners p = corners(key_, t);
    const Eigen::Vector3d normal = doubled_area_vector(p);
    // As the stiffness has it: a flat triangle counts as one of the area that cotangent_flatness gives it.
    const double doubled = std::max(normal.norm(), cotangent_flatness * longest_edge_squared(p));
    Element element{Eigen::Matrix<double, 3, 2>::Zero(), degenerate_corners(corners(key_low_, t))};
    if (normal.norm() > 0) {
      // The gradient of a hat function is the opposite edge turned by a right angle, over twice the area.
      const Eigen::Vector3d n = normal.normalized();
      element.gradients.col(0) = 0.5 * n.cross(p.col(0) - p.col(2)) * (normal.norm() / doubled);
      element.gradients.col(1) = 0.5 * n.cross(p.col(1) - p.col(0)) * (normal.norm() / doubled);
    }
    elements_.push_back(element);
  }
}

Points DetailTransfer::apply(const Points& frame_low) const {
  switch (method_) {
    case TransferMethod::poisson:
      return with_poisson(frame_low);
    case TransferMethod::rotations:
      return with_rotations(frame_low);
    case TransferMethod::none:
      break;
  }
  return frame_low;
}

Points DetailTransfer::with_rotations(const Points& frame_low) const {
  Points x = frame_low;
  for (int v = 0; v < neighbours_.vertices(); ++v) {
    const Eigen::Matrix3d r = ring_rotation(neighbours_, key_low_, frame_low, v);
    for (int c = 0; c < 3; ++c) {
      x(v, c) += r(c, 0) * detail_(v, 0) + r(c, 1) * detail_(v, 1) + r(c, 2) * detail_(v, 2);
    }
  }
  return x;
}

Points DetailTransfer::with_poisson(const Points& frame_low) const {
  // Divergence of S_t k: what the stiffness makes of the mesh that is looked for. By rows.
  std::vector<double> x(static_cast<std::size_t>(key_.rows()) * 3), scratch;
  for (std::size_t e = 0; e < triangles_.size(); ++e) {
    const Triangle& t = triangles_[e];
    const Corners low = corners(key_low_, t), to = corners(frame_low, t);
    Eigen::Matrix3d s = deformation_gradient(low, to);
    if (elements_[e].degenerate || s.squaredNorm() > 3 * most_stretch * most_stretch) {
      Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
      for (const std::int32_t v : t) sum += ring_rotation(neighbours_, key_low_, frame_low, v);
      s = nearest_rotation(sum);
    }
    const Eigen::Matrix<double, 3, 2> flow = s * elements_[e].gradients;
    for (int c = 0; c < 3; ++c) {
      x[static_cast<std::size_t>(3 * t[1] + c)] += flow(c, 0);
      x[static_cast<std::size_t>(3 * t[2] + c)] += flow(c, 1);
      x[static_cast<std::size_t>(3 * t[0] + c)] -= flow(c, 0) + flow(c, 1);
    }
  }
  solver_->solve(x.data(), 3, scratch);
  Points out(key_.rows(), 3);
  for (Eigen::Index v = 0; v < out.rows(); ++v) {
    for (int c = 0; c < 3; ++c) out(v, c) = x[static_cast<std::size_t>(3 * v + c)];
  }
  place_components(frame_low, out);
  return out;
}

void DetailTransfer::place_components(const Points& frame_low, Points& x) const {
  std::vector<Eigen::Vector4d> shift(static_cast<std::size_t>(components_.count), Eigen::Vector4d::Zero());
  for (Eigen::Index v = 0; v < x.rows(); ++v) {
    auto& sum = shift[static_cast<std::size_t>(components_.of[static_cast<std::size_t>(v)])];
    for (int c = 0; c < 3; ++c) sum[c] += frame_low(v, c) - x(v, c);
    sum[3] += 1;
  }
  for (Eigen::Index v = 0; v < x.rows(); ++v) {
    const auto& sum = shift[static_cast<std::size_t>(components_.of[static_cast<std::size_t>(v)])];
    for (int c = 0; c < 3; ++c) x(v, c) += sum[c] / sum[3];
  }
}

Points correct_low_frequencies(Points x, const Coefficients& c, const Projection& space) {
  const Coefficients missing = c - space.correlations(x);
  space.add(missing, x);
  return x;
}

}  // namespace kinespace
