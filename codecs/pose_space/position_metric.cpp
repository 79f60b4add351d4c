#include "kinespace/codecs/pose_space/position_metric.h"

#include <cmath>
#include <vector>

#include "kinespace/base/parallel.h"
#include "kinespace/codecs/stream/natural_functions.h"
#include "kinespace/motion/error_measures.h"

namespace kinespace {
namespace {

using Rotation = Eigen::Matrix3d;

Rotation matrix_of(const Eigen::Quaterniond& q) {
  return q.toRotationMatrix();
}

// From a change of the parameters to the angular velocity in the joint's own frame.
Rotation parameter_velocity(const Eigen::Vector3d& m) {
  const Eigen::Vector3d s = m / 4;
  const double square = s.x() * s.x() + s.y() * s.y() + s.z() * s.z();
  Rotation out = 2 * s * s.transpose();
  for (int k = 0; k < 3; ++k) out(k, k) += 1 - square;
  out(0, 1) += 2 * s.z();
  out(0, 2) -= 2 * s.y();
  out(1, 0) -= 2 * s.z();
  out(1, 2) += 2 * s.x();
  out(2, 0) += 2 * s.y();
  out(2, 1) -= 2 * s.x();
  return out / ((1 + square) * (1 + square));
}

// The skeleton as it stands, and the axes that each dimension of the pose turns it about.
struct Posture {
  std::vector<Eigen::Vector3d> position;
  std::vector<Rotation> rotation;
  std::vector<Rotation> axes;  // by rotating joint: world axes of its three parameters
  std::vector<std::vector<int>>
      above;  // by joint: the rotating joints (numbers in the layout) that turn it, itself too
};

Posture stand(const Skeleton& skeleton, const ReferencePose& reference, std::span<const double> pose) {
  const std::vector<int> rotating = skeleton.rotating_joints();
  const auto n = static_cast<std::size_t>(skeleton.joint_count());
  std::vector<int> number(n, -1);
  for (std::size_t k = 0; k < rotating.size(); ++k) number[static_cast<std::size_t>(rotating[k])] = static_cast<int>(k);
  Posture out{.position = std::vector<Eigen::Vector3d>(n, Eigen::Vector3d::Zero()),
              .rotation = std::vector<Rotation>(n, Rotation::Identity()),
              .axes = std::vector<Rotation>(rotating.size()),
              .above = std::vector<std::vector<int>>(n)};
  for (std::size_t j = 0; j < n; ++j) {
    const int parent = skeleton.joints[j].parent;
    const int k = number[j];
    const bool root = k == 0;
    if (parent >= 0 && !root) {
      const auto p = static_cast<std::size_t>(parent);
      out.above[j] = out.above[p];
      out.rotation[j] = out.rotation[p];
      out.position[j] = out.position[p] + out.rotation[p] * skeleton.joints[j].offset;
    }
    if (k < 0) continue;
    const double* m = pose.data() + 4 + 3 * k;
    const Eigen::Vector3d parameters(m[0], m[1], m[2]);
    const double square = parameters.squaredNorm() / 16;
    const Eigen::Quaterniond turn((1 - square) / (1 + square), parameters.x() / 2 / (1 + square),
                                  parameters.y() / 2 / (1 + square), parameters.z() / 2 / (1 + square));
    if (root) {
      double sine = 0, cosine = 0;
      fixed_sin_cos(pose[3] / 2, sine, cosine);
      out.rotation[j] = matrix_of(Eigen::Quaterniond(cosine, 0, sine, 0));
      out.position[j] = Eigen::Vector3d(pose[0], pose[1], pose[2]);
    }
    out.rotation[j] = out.rotation[j] * matrix_of(reference.orientation(k) * turn);
    out.axes[static_cast<std::size_t>(k)] = out.rotation[j] * parameter_velocity(parameters);
    out.above[j].push_back(k);
  }
  return out;
}

// Adds weight * (d point)' (d point) of one point that hangs on `joint`.
class PointSums {
 public:
  PointSums(const Posture& posture, const std::vector<int>& rotating) : posture_(posture), rotating_(rotating) {}

  void add(std::size_t joint, const Eigen::Vector3d& point, double weight, Eigen::MatrixXd& sum) {
    columns_.clear();
    derivative_.clear();
    for (int k = 0; k < 3; ++k) push(k, Eigen::Vector3d::Unit(k));
    push(3, Eigen::Vector3d::UnitY().cross(point - origin(0)));
    for (const int k : posture_.above[joint]) {
      const Rotation& axes = posture_.axes[static_cast<std::size_t>(k)];
      for (int a = 0; a < 3; ++a) push(4 + 3 * k + a, Eigen::Vector3d(axes.col(a)).cross(point - origin(k)));
    }
    for (std::size_t b = 0; b < columns_.size(); ++b) {
      for (std::size_t a = 0; a <= b; ++a) {
        sum(columns_[b], columns_[a]) +=
            weight * (derivative_[a].x() * derivative_[b].x() + derivative_[a].y() * derivative_[b].y() +
                      derivative_[a].z() * derivative_[b].z());
      }
    }
  }

 private:
  [[nodiscard]] const Eigen::Vector3d& origin(int k) const {
    return posture_.position[static_cast<std::size_t>(rotating_[static_cast<std::size_t>(k)])];
  }
  void push(int column, const Eigen::Vector3d& derivative) {
    columns_.push_back(column);
    derivative_.push_back(derivative);
  }
  const Posture& posture_;
  const std::vector<int>& rotating_;
  std::vector<int> columns_;
  std::vector<Eigen::Vector3d> derivative_;
};

Eigen::MatrixXd lift_diagonal(Eigen::MatrixXd m, double part) {
  double trace = 0;
  for (Eigen::Index i = 0; i < m.rows(); ++i) trace += m(i, i);
  for (Eigen::Index i = 0; i < m.rows(); ++i) m(i, i) += part * m(i, i) + 1e-9 * trace + 1e-9;
  return m;
}

void mirror(Eigen::MatrixXd& m) {
  for (Eigen::Index c = 0; c < m.cols(); ++c) {
    for (Eigen::Index r = c + 1; r < m.rows(); ++r) m(c, r) = m(r, c);
  }
}

}  // namespace

Eigen::MatrixXd PoseMetric::combined(double shell_weight) const {
  return lift_diagonal(positions + shell_weight * shell, 1e-6);
}

Eigen::MatrixXd PoseMetric::lifted(double shell_weight) const {
  return lift_diagonal(positions + shell_weight * shell, 4);
}

PoseMetric pose_metric(const Skeleton& skeleton, const ReferencePose& reference, std::span<const double> pose) {
  const std::vector<int> rotating = skeleton.rotating_joints();
  const Posture posture = stand(skeleton, reference, pose);
  const Eigen::Index d = reference.dimensions();
  PoseMetric out{Eigen::MatrixXd::Zero(d, d), Eigen::MatrixXd::Zero(d, d)};
  PointSums sums(posture, rotating);
  for (std::size_t j = 0; j < posture.position.size(); ++j) {
    if (posture.above[j].empty()) continue;  // above the travel root: moved by nothing here
    sums.add(j, posture.position[j], 1, out.positions);
    for (int k = 0; k < 3; ++k) {
      sums.add(j, posture.position[j] + shell_cm * posture.rotation[j].col(k), 1.0 / 3, out.shell);
    }
  }
  mirror(out.positions);
  mirror(out.shell);
  return out;
}

Eigen::MatrixXd fixed_cholesky(const Eigen::MatrixXd& matrix) {
  const Eigen::Index n = matrix.rows();
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index c = 0; c < n; ++c) {
    for (Eigen::Index r = c; r < n; ++r) {
      double sum = matrix(r, c);
      for (Eigen::Index k = 0; k < c; ++k) sum -= out(r, k) * out(c, k);
      if (r == c) {
        out(r, c) = std::sqrt(sum > 1e-300 ? sum : 1e-300);
      } else {
        out(r, c) = sum / out(c, c);
      }
    }
  }
  return out;
}

Eigen::MatrixXd solve_transposed(const Eigen::MatrixXd& lower, const Eigen::MatrixXd& right) {
  const Eigen::Index n = lower.rows();
  Eigen::MatrixXd out(n, right.cols());
  for (Eigen::Index c = 0; c < right.cols(); ++c) {
    for (Eigen::Index r = n - 1; r >= 0; --r) {
      double sum = right(r, c);
      for (Eigen::Index k = r + 1; k < n; ++k) sum -= lower(k, r) * out(k, c);
      out(r, c) = sum / lower(r, r);
    }
  }
  return out;
}

Eigen::MatrixXd pose_moments(std::span<const PoseVectors> vectors, int dimensions) {
  std::vector<Eigen::MatrixXd> parts(vectors.size());
  parallel_for(std::size_t{0}, vectors.size(), [&](std::size_t c) {
    parts[c] = Eigen::MatrixXd::Zero(dimensions, dimensions);
    parts[c].selfadjointView<Eigen::Lower>().rankUpdate(pose_curves(vectors[c], dimensions));
  });
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(dimensions, dimensions);
  std::int64_t frames = 0;
  for (std::size_t c = 0; c < vectors.size(); ++c) {
    out += parts[c];
    frames += vectors[c].frames;
  }
  return Eigen::MatrixXd(out.selfadjointView<Eigen::Lower>()) / static_cast<double>(frames);
}

PoseMetric mean_pose_metric(std::span<const Clip> clips, std::span<const PoseVectors> vectors,
                            const ReferencePose& reference) {
  constexpr std::int64_t most_samples = 256;
  const int d = reference.dimensions();
  std::vector<std::int64_t> first{0};
  for (const PoseVectors& v : vectors) first.push_back(first.back() + v.frames);
  const std::int64_t samples = std::min(first.back(), most_samples);
  std::vector<PoseMetric> parts(static_cast<std::size_t>(samples));
  parallel_for(std::int64_t{0}, samples, [&](std::int64_t s) {
    const std::int64_t frame = (2 * s + 1) * first.back() / (2 * samples);
    const auto c = static_cast<std::size_t>(std::ranges::upper_bound(first, frame) - first.begin()) - 1;
    const Eigen::VectorXd pose = pose_curves(vectors[c], d).col(frame - first[c]);
    parts[static_cast<std::size_t>(s)] =
        pose_metric(clips[c].skeleton, reference, std::span(pose.data(), static_cast<std::size_t>(d)));
  });
  PoseMetric out{Eigen::MatrixXd::Zero(d, d), Eigen::MatrixXd::Zero(d, d)};
  for (const PoseMetric& part : parts) {
    out.positions += part.positions / static_cast<double>(samples);
    out.shell += part.shell / static_cast<double>(samples);
  }
  return out;
}

}  // namespace kinespace
