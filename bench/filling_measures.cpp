#include "bench/filling_measures.h"

#include <cmath>
#include <numbers>

#include "kinespace/motion/curves.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

using Eigen::Index;

// Cumulative normalised power of a curve, and its total power.
double cumulative_power(const Eigen::VectorXd& curve, Eigen::VectorXd& out) {
  const Index n = curve.size();
  out.resize(n / 2 + 1);
  for (Index k = 0; k < out.size(); ++k) {
    double re = 0;
    double im = 0;
    for (Index t = 0; t < n; ++t) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(k * t % n) / static_cast<double>(n);
      re += curve(t) * std::cos(angle);
      im += curve(t) * std::sin(angle);
    }
    out(k) = re * re + im * im;
  }
  const double total = out.sum();
  if (total > 0) out /= total;
  for (Index k = 1; k < out.size(); ++k) out(k) += out(k - 1);
  return total;
}

}  // namespace

PositionScale position_scale(std::span<const Clip> library) {
  constexpr double reach_s = 1.5;
  const Index size = 3 * static_cast<Index>(library.front().skeleton.joint_count());
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(size);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(size);
  double count = 0;
  std::vector<JointFrame> reference;
  std::vector<JointFrame> at;
  Eigen::VectorXd row(size);
  for (const Clip& clip : library) {
    const auto root = static_cast<std::size_t>(clip.skeleton.travel_root());
    const int step = std::max(1, static_cast<int>(reach_s / 3 * clip.rate_hz));
    for (int f = 0; f + 3 * step < clip.frames; f += 3 * step) {
      world_frames(clip, f, reference);
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(-heading_of(reference[root].rotation), Eigen::Vector3d::UnitY()));
      const Eigen::Vector3d ground(reference[root].position.x(), 0, reference[root].position.z());
      for (int k = 1; k <= 3; ++k) {
        world_frames(clip, f + k * step, at);
        for (std::size_t j = 0; j < at.size(); ++j) {
          row.segment<3>(3 * static_cast<Index>(j)) = turn * (at[j].position - ground);
        }
        sum += row;
        squares += row.cwiseAbs2();
        ++count;
      }
    }
  }
  return {.deviation = (squares / count - (sum / count).cwiseAbs2()).cwiseMax(1e-6).cwiseSqrt()};
}

void FillingMeasures::add(const Clip& truth, const Clip& filled, FrameRange gap) {
  const auto joints = static_cast<std::size_t>(truth.skeleton.joint_count());
  Eigen::MatrixXd true_q(gap.count(), 4 * static_cast<Index>(joints));
  Eigen::MatrixXd filled_q = true_q;
  std::vector<JointFrame> a;
  std::vector<JointFrame> b;
  // L2P's coordinates look along the heading of the frame before the gap.
  world_frames(truth, gap.first_frame - 1, a);
  const double heading = heading_of(a[static_cast<std::size_t>(truth.skeleton.travel_root())].rotation);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-heading, Eigen::Vector3d::UnitY()));
  double error = 0;
  double l2p = 0;
  double l2q = 0;
  for (int f = gap.first_frame; f <= gap.last_frame; ++f) {
    world_frames(truth, f, a);
    world_frames(filled, f, b);
    double scaled = 0;
    for (std::size_t j = 0; j < joints; ++j) {
      const auto k = static_cast<Index>(j);
      const Eigen::Vector3d apart = b[j].position - a[j].position;
      error += apart.norm();
      scaled += (turn * apart).cwiseQuotient(scale_.deviation.segment<3>(3 * k)).squaredNorm();
      const Eigen::Vector4d q = a[j].rotation.coeffs();
      const Eigen::Vector4d p = b[j].rotation.coeffs();
      const double side = q.dot(p) < 0 ? -1 : 1;
      true_q.row(f - gap.first_frame).segment<4>(4 * k) = q.transpose();
      filled_q.row(f - gap.first_frame).segment<4>(4 * k) = side * p.transpose();
    }
    l2p += std::sqrt(scaled);
    l2q += (true_q - filled_q).row(f - gap.first_frame).norm();
  }
  joint_error_ += error / (gap.count() * static_cast<double>(joints));
  l2p_ += l2p / gap.count();
  l2q_ += l2q / gap.count();
  ++gaps_;
  // Both curves on one side in time before their spectra: jumps of sign are no motion.
  for (Index c = 0; c < true_q.cols(); c += 4) {
    for (Index t = 1; t < true_q.rows(); ++t) {
      if (true_q.row(t).segment<4>(c).dot(true_q.row(t - 1).segment<4>(c)) >= 0) continue;
      true_q.row(t).segment<4>(c) *= -1;
      filled_q.row(t).segment<4>(c) *= -1;
    }
  }
  add_spectra(true_q, filled_q);
}

void FillingMeasures::add_spectra(const Eigen::MatrixXd& truth, const Eigen::MatrixXd& filled) {
  Eigen::VectorXd a;
  Eigen::VectorXd b;
  for (Index c = 0; c < truth.cols(); ++c) {
    const double power = cumulative_power(truth.col(c), a);
    (void)cumulative_power(filled.col(c), b);
    spectrum_ += power * (a - b).cwiseAbs().sum();
    power_ += power;
  }
}

}  // namespace kinespace
