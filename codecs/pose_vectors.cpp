#include "codecs/pose_vectors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "base/error.h"
#include "codecs/natural_functions.h"
#include "motion/simd.h"

namespace kinespace {
namespace {

constexpr double farthest_cm = 1e7;
constexpr double largest_parameter = 5.2;  // 4 tan(210 degrees / 4)

Eigen::Quaterniond about_vertical(double angle) {
  double sine = 0, cosine = 0;
  fixed_sin_cos(angle / 2, sine, cosine);
  return {cosine, 0, sine, 0};
}

Eigen::Quaterniond curve_quaternion(const ClipCurves& curves, int frame, int joint) {
  const auto q = curves.values.row(frame).segment<4>(3 + 4 * joint);
  return {q(0), q(1), q(2), q(3)};
}

// Twist about the vertical, unwrapped; across frames where it is ill defined (the root turned over by more than 140
// degrees) a straight line.
std::vector<double> headings(const ClipCurves& curves, const Eigen::Quaterniond& turn) {
  constexpr double defined = 0.34;  // cosine of half of 140 degrees
  const int frames = curves.frames();
  std::vector<double> out(static_cast<std::size_t>(frames), 0.0);
  int last = -1;
  for (int f = 0; f < frames; ++f) {
    const Eigen::Quaterniond q = turn * curve_quaternion(curves, f, 0);
    if (std::hypot(q.w(), q.y()) < defined) continue;
    double angle = 2 * std::atan2(q.y(), q.w());
    const double before = last < 0 ? 0 : out[static_cast<std::size_t>(last)];
    angle -= 2 * std::numbers::pi * std::round((angle - before) / (2 * std::numbers::pi));
    for (int g = last + 1; g <= f; ++g) {
      const double part = last < 0 ? 1 : static_cast<double>(g - last) / (f - last);
      out[static_cast<std::size_t>(g)] = last < 0 ? angle : before + part * (angle - before);
    }
    last = f;
  }
  for (int g = last + 1; g < frames && last >= 0; ++g) {
    out[static_cast<std::size_t>(g)] = out[static_cast<std::size_t>(last)];
  }
  return out;
}

CoarsePlacement place(const ClipCurves& curves) {
  CoarsePlacement out;
  for (std::size_t k = 0; k < 3; ++k) {
    const double start = curves.placement.start_cm[static_cast<Eigen::Index>(k)];
    const double farthest = start + 100 * curves.values.col(static_cast<Eigen::Index>(k)).cwiseAbs().maxCoeff();
    if (!(std::abs(start) < farthest_cm) || !(std::abs(farthest) < farthest_cm)) {
      throw Error(ErrorKind::bad_input, {.file = curves.name,
                                         .found = "a root that is no number or farther than 100 km from the origin",
                                         .expected = "positions in centimetres"});
    }
    out.position[k] = static_cast<std::int32_t>(std::lround(start / CoarsePlacement::cm_per_step));
  }
  const double turns = curves.placement.heading_rad / (2 * std::numbers::pi);
  out.heading = static_cast<std::int32_t>(std::lround(turns * CoarsePlacement::steps_per_turn));
  return out;
}

// The parameters of one joint over time; marks the frames where the other quaternion takes over.
void joint_parameters(std::span<const Eigen::Quaterniond> turns, std::span<double> values, std::vector<bool>& jumps) {
  const std::size_t n = turns.size();
  double mean_w = 0;
  double sign = 1;
  for (std::size_t f = 0; f < n; ++f) {
    if (f > 0 && turns[f].coeffs().dot(turns[f - 1].coeffs()) < 0) sign = -sign;
    mean_w += sign * turns[f].w();
  }
  sign = mean_w < 0 ? -1 : 1;
  for (std::size_t f = 0; f < n; ++f) {
    if (f > 0 && turns[f].coeffs().dot(turns[f - 1].coeffs()) < 0) sign = -sign;
    const double scale = 4 / std::max(1 + sign * turns[f].w(), 1e-9);
    if (scale * turns[f].vec().norm() > largest_parameter) {
      sign = -sign;
      if (f > 0) jumps[f] = true;
    }
    const Eigen::Vector3d m = 4 * sign / (1 + sign * turns[f].w()) * turns[f].vec();
    for (std::size_t k = 0; k < 3; ++k) values[k * n + f] = m[static_cast<Eigen::Index>(k)];
  }
}

KINESPACE_VECTOR_CLONES void write_quaternions(const double* x, const double* y, const double* z, const double* r,
                                               double* out, std::size_t n) {
  for (std::size_t f = 0; f < n; ++f) {
    const double square = (x[f] * x[f] + y[f] * y[f] + z[f] * z[f]) * 0.0625;
    const double inverse = 1 / (1 + square);
    const double w = (1 - square) * inverse;
    const double a = 0.5 * x[f] * inverse;
    const double b = 0.5 * y[f] * inverse;
    const double c = 0.5 * z[f] * inverse;
    out[4 * f] = r[0] * w - r[1] * a - r[2] * b - r[3] * c;
    out[4 * f + 1] = r[0] * a + r[1] * w + r[2] * c - r[3] * b;
    out[4 * f + 2] = r[0] * b - r[1] * c + r[2] * w + r[3] * a;
    out[4 * f + 3] = r[0] * c + r[1] * b - r[2] * a + r[3] * w;
  }
}

}  // namespace

Eigen::Quaterniond ReferencePose::orientation(int joint) const {
  const auto& s = steps[static_cast<std::size_t>(joint)];
  const Eigen::Vector3d v = Eigen::Vector3d(s[0], s[1], s[2]) / 127;
  const double w = std::sqrt(std::max(0.0, 1 - v.squaredNorm()));
  const double norm = std::sqrt(w * w + v.squaredNorm());
  return {w / norm, v.x() / norm, v.y() / norm, v.z() / norm};
}

Eigen::Vector3d CoarsePlacement::start_cm() const {
  return cm_per_step * Eigen::Vector3d(position[0], position[1], position[2]);
}

Eigen::Quaterniond CoarsePlacement::turn() const {
  return about_vertical(2 * std::numbers::pi * heading / steps_per_turn);
}

ReferencePoseBuilder::ReferencePoseBuilder(const Skeleton& skeleton)
    : sums_(skeleton.rotating_joints().size(), Eigen::Matrix4d::Zero()) {}

void ReferencePoseBuilder::add(const ClipCurves& curves) {
  const CoarsePlacement placement = place(curves);
  const Eigen::Quaterniond turn = placement.turn().conjugate() * about_vertical(curves.placement.heading_rad);
  const std::vector<double> heading = headings(curves, turn);
  for (int f = 0; f < curves.frames(); ++f) {
    for (std::size_t j = 0; j < sums_.size(); ++j) {
      Eigen::Quaterniond q = curve_quaternion(curves, f, static_cast<int>(j));
      if (j == 0) q = about_vertical(-heading[static_cast<std::size_t>(f)]) * turn * q;
      const Eigen::Vector4d v(q.w(), q.x(), q.y(), q.z());
      sums_[j] += v * v.transpose();
    }
  }
}

ReferencePose ReferencePoseBuilder::build() const {
  ReferencePose out;
  for (const Eigen::Matrix4d& sum : sums_) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sum);
    Eigen::Vector4d q = solver.eigenvectors().col(3);
    if (q[0] < 0) q = -q;
    std::array<std::int8_t, 3> steps{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double component = q[static_cast<Eigen::Index>(k) + 1];
      steps[k] = std::isfinite(component) ? static_cast<std::int8_t>(std::lround(127 * component)) : std::int8_t{0};
    }
    out.steps.push_back(steps);
  }
  return out;
}

PoseVectors pose_vectors(const ClipCurves& curves, const ReferencePose& reference) {
  PoseVectors out{.frames = curves.frames(), .placement = place(curves), .side_tracks = curves.side_tracks};
  const auto n = static_cast<std::size_t>(out.frames);
  if (!curves.values.allFinite()) {
    throw Error(
        ErrorKind::bad_input,
        {.file = curves.name, .found = "a value that is no number", .expected = "finite rotations and positions"});
  }
  out.values.resize(static_cast<std::size_t>(reference.dimensions()) * n);
  const Eigen::Quaterniond back = out.placement.turn().conjugate();
  const Eigen::Quaterniond from_curves = about_vertical(curves.placement.heading_rad);
  const Eigen::Quaterniond turn = back * from_curves;
  const std::vector<double> heading = headings(curves, turn);
  std::ranges::copy(heading, out.values.begin() + static_cast<std::ptrdiff_t>(3 * n));
  for (std::size_t f = 0; f < n; ++f) {
    const Eigen::Vector3d travel = 100 * curves.values.row(static_cast<Eigen::Index>(f)).head<3>().transpose();
    const Eigen::Vector3d p = back * (curves.placement.start_cm + from_curves * travel - out.placement.start_cm());
    for (std::size_t k = 0; k < 3; ++k) out.values[k * n + f] = p[static_cast<Eigen::Index>(k)];
  }
  std::vector<bool> jumps(n, false);
  std::vector<Eigen::Quaterniond> turns(n);
  for (int j = 0; j < reference.joint_count(); ++j) {
    const Eigen::Quaterniond from = reference.orientation(j).conjugate();
    for (std::size_t f = 0; f < n; ++f) {
      Eigen::Quaterniond q = curve_quaternion(curves, static_cast<int>(f), j).normalized();
      if (j == 0) q = about_vertical(-heading[f]) * turn * q;
      turns[f] = from * q;
    }
    joint_parameters(turns, std::span(out.values).subspan(static_cast<std::size_t>(4 + 3 * j) * n, 3 * n), jumps);
  }
  for (std::size_t f = 1; f < n; ++f) {
    if (jumps[f]) out.jumps.push_back(static_cast<int>(f));
  }
  return out;
}

void apply_side_track(const SideTrack& track, int first, Clip& clip) {
  const auto d = static_cast<std::size_t>(track.dimensions);
  std::size_t piece = 0;
  std::array<double, 4> v{};
  for (int f = 0; f < clip.frames; ++f) {
    const int frame = first + f;
    while (piece + 2 < track.frames.size() && track.frames[piece + 1] <= frame) ++piece;
    const std::size_t next = std::min(piece + 1, track.frames.size() - 1);
    const double span = std::max(1, track.frames[next] - track.frames[piece]);
    const double b = (frame - track.frames[piece]) / span;
    for (std::size_t k = 0; k < d; ++k) v[k] = (1 - b) * track.values[piece * d + k] + b * track.values[next * d + k];
    if (d == 3) {
      clip.require_translation_track(track.joint).values[static_cast<std::size_t>(f)] = {v[0], v[1], v[2]};
    } else {
      clip.set_rotation(track.joint, f, Eigen::Quaterniond(v[0], v[1], v[2], v[3]).normalized());
    }
  }
}

PoseWriter::PoseWriter(const ReferencePose& reference, const CoarsePlacement& placement, Clip& clip)
    : start_(placement.start_cm()), turn_(placement.turn()), clip_(clip), joints_(clip.skeleton.rotating_joints()) {
  for (int j = 0; j < reference.joint_count(); ++j) reference_.push_back(reference.orientation(j));
  for (int j = clip.skeleton.joints[static_cast<std::size_t>(joints_.front())].parent; j >= 0;
       j = clip.skeleton.joints[static_cast<std::size_t>(j)].parent) {
    above_.insert(above_.begin(), j);
  }
  clip.require_translation_track(joints_.front());
}

void PoseWriter::write(std::span<const double> vectors, int first, int count) {
  const auto n = static_cast<std::size_t>(count);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const double* x = vectors.data() + (4 + 3 * j) * n;
    const Eigen::Quaterniond& q = reference_[j];
    const std::array<double, 4> r{q.w(), q.x(), q.y(), q.z()};
    write_quaternions(x, x + n, x + 2 * n, r.data(),
                      clip_.rotation_track(joints_[j]).data() + 4 * static_cast<std::size_t>(first), n);
  }
  write_root(vectors, first, count);
}

void PoseWriter::write_root(std::span<const double> vectors, int first, int count) {
  const auto n = static_cast<std::size_t>(count);
  const int root = joints_.front();
  auto& travel = clip_.require_translation_track(root).values;
  for (std::size_t i = 0; i < n; ++i) {
    const int f = first + static_cast<int>(i);
    const Eigen::Vector3d position = start_ + turn_ * Eigen::Vector3d(vectors[i], vectors[n + i], vectors[2 * n + i]);
    const Eigen::Quaterniond rotation = turn_ * about_vertical(vectors[3 * n + i]) * clip_.rotation(root, f);
    Eigen::Vector3d base = Eigen::Vector3d::Zero();
    Eigen::Quaterniond base_turn = Eigen::Quaterniond::Identity();
    for (const int j : above_) {
      base += base_turn * clip_.translation(j, f);
      base_turn = base_turn * clip_.rotation(j, f);
    }
    travel[static_cast<std::size_t>(f)] = base_turn.conjugate() * (position - base);
    clip_.set_rotation(root, f, (base_turn.conjugate() * rotation));
  }
}

}  // namespace kinespace
