#include "kinespace/codecs/stream/pose_vectors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/stream/natural_functions.h"
#include "kinespace/motion/simd.h"

namespace kinespace {
namespace {

constexpr double farthest_cm = 1e7;
constexpr double largest_parameter = 5.2;  // 4 tan(210 degrees / 4)

Eigen::Quaterniond about_vertical(double angle) {
  double sine = 0, cosine = 0;
  fixed_sin_cos(angle / 2, sine, cosine);
  return {cosine, 0, sine, 0};
}

// The curves of the travel root and the side tracks of what stands above it: those of the clip without what is below,
// as the joints above are the first of the skeleton.
ClipCurves root_curves(const Clip& clip) {
  const int joints = clip.skeleton.travel_root() + 1;
  Clip chain{.name = clip.name, .skeleton = clip.skeleton, .rate_hz = clip.rate_hz, .frames = clip.frames};
  chain.skeleton.joints.resize(static_cast<std::size_t>(joints));
  const std::size_t numbers = static_cast<std::size_t>(joints) * 4 * static_cast<std::size_t>(clip.frames);
  chain.rotations.assign(clip.rotations.begin(), clip.rotations.begin() + static_cast<std::ptrdiff_t>(numbers));
  for (const Clip::TranslationTrack& track : clip.translations) {
    if (track.joint < joints) chain.translations.push_back(track);
  }
  return clip_curves(chain);
}

// The side track of a joint below the travel root: that of a clip in which nothing else moves.
SideTrack side_track_below(const Clip& clip, const Clip::TranslationTrack& track) {
  const Skeleton root_and_joint{.joints = {{.name = "root"}, {.name = "joint", .parent = 0}}};
  Clip alone = make_clip(clip.name, root_and_joint, clip.rate_hz, clip.frames);
  alone.translations.push_back({1, track.values});
  SideTrack out = clip_curves(alone).side_tracks.front();
  out.joint = track.joint;
  return out;
}

// Of the whole clip: rotations, then translations, each by joint.
std::vector<SideTrack> all_side_tracks(const Clip& clip, std::vector<SideTrack> of_root) {
  std::vector<SideTrack> out = std::move(of_root);
  for (const Clip::TranslationTrack& track : clip.translations) {
    if (track.joint > clip.skeleton.travel_root()) out.push_back(side_track_below(clip, track));
  }
  return out;
}

Eigen::Quaterniond root_quaternion(const ClipCurves& root, std::size_t frame) {
  const auto q = root.values.row(static_cast<Eigen::Index>(frame)).segment<4>(3);
  return {q(0), q(1), q(2), q(3)};
}

// Twist about the vertical, unwrapped; across frames where it is ill defined (the root turned over by more than 140
// degrees) a straight line.
std::vector<double> headings(const ClipCurves& root, const Eigen::Quaterniond& turn) {
  constexpr double defined = 0.34;  // cosine of half of 140 degrees
  const int frames = root.frames();
  std::vector<double> out(static_cast<std::size_t>(frames), 0.0);
  int last = -1;
  for (int f = 0; f < frames; ++f) {
    const Eigen::Quaterniond q = turn * root_quaternion(root, static_cast<std::size_t>(f));
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

CoarsePlacement placement_of(const ClipCurves& curves) {
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

// The travel root in the clip's own frame.
struct RootPath {
  explicit RootPath(const ClipCurves& root)
      : placement(placement_of(root)),
        from_curves(about_vertical(root.placement.heading_rad)),
        turn(placement.turn().conjugate() * from_curves),
        heading(headings(root, turn)) {}

  // An orientation of the root's curve without its heading.
  [[nodiscard]] Eigen::Quaterniond without_heading(const Eigen::Quaterniond& q, std::size_t frame) const {
    return about_vertical(-heading[frame]) * turn * q;
  }

  // Dimensions 0 to 3 of `values`, [dimension][frame].
  void write(const ClipCurves& root, std::span<double> values) const {
    const std::size_t n = heading.size();
    const Eigen::Quaterniond back = placement.turn().conjugate();
    for (std::size_t f = 0; f < n; ++f) {
      const Eigen::Vector3d travel = 100 * root.values.row(static_cast<Eigen::Index>(f)).head<3>().transpose();
      const Eigen::Vector3d p = back * (root.placement.start_cm + from_curves * travel - placement.start_cm());
      for (std::size_t k = 0; k < 3; ++k) values[k * n + f] = p[static_cast<Eigen::Index>(k)];
    }
    std::ranges::copy(heading, values.begin() + static_cast<std::ptrdiff_t>(3 * n));
  }

  CoarsePlacement placement;
  Eigen::Quaterniond from_curves;
  Eigen::Quaterniond turn;
  std::vector<double> heading;
};

void add_outer(const Eigen::Quaterniond& q, Eigen::Matrix4d& sum) {
  const Eigen::Vector4d v(q.w(), q.x(), q.y(), q.z());
  sum += v * v.transpose();
}

void add_root(const Clip& clip, Eigen::Matrix4d& sum) {
  const ClipCurves root = root_curves(clip);
  const RootPath path(root);
  for (std::size_t f = 0; f < path.heading.size(); ++f) {
    add_outer(path.without_heading(root_quaternion(root, f), f), sum);
  }
}

std::array<std::int8_t, 3> reference_steps(const Eigen::Matrix4d& sum) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sum);
  Eigen::Vector4d q = solver.eigenvectors().col(3);
  if (q[0] < 0) q = -q;
  std::array<std::int8_t, 3> steps{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double component = q[static_cast<Eigen::Index>(k) + 1];
    steps[k] = std::isfinite(component) ? static_cast<std::int8_t>(std::lround(127 * component)) : std::int8_t{0};
  }
  return steps;
}

void require_finite(const Clip& clip, bool finite) {
  if (finite) return;
  throw Error(ErrorKind::bad_input,
              {.file = clip.name, .found = "a value that is no number", .expected = "finite rotations and positions"});
}

// The orientations of a joint other than the travel root, without sign flips from frame to frame.
void unit_turns(const Clip& clip, int joint, std::span<Eigen::Quaterniond> out) {
  Eigen::Quaterniond before = clip.rotation(joint, 0);
  for (std::size_t f = 0; f < out.size(); ++f) {
    Eigen::Quaterniond q = clip.rotation(joint, static_cast<int>(f));
    require_finite(clip, q.coeffs().allFinite());
    if (q.coeffs().dot(before.coeffs()) < 0) q.coeffs() *= -1;
    before = q;
    out[f] = q.normalized();
  }
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

ReferencePose reference_pose(std::span<const Clip> clips) {
  const std::vector<int> joints = clips.front().skeleton.rotating_joints();
  ReferencePose out;
  out.steps.resize(joints.size());
  parallel_for(std::size_t{0}, joints.size(), [&](std::size_t j) {
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    for (const Clip& clip : clips) {
      if (j == 0) {
        add_root(clip, sum);
      } else {
        for (int f = 0; f < clip.frames; ++f) add_outer(clip.rotation(joints[j], f), sum);
      }
    }
    out.steps[j] = reference_steps(sum);
  });
  return out;
}

PoseVectors pose_vectors(const Clip& clip, const ReferencePose& reference) {
  ClipCurves root = root_curves(clip);
  const RootPath path(root);
  require_finite(clip, root.values.allFinite());
  PoseVectors out{.frames = clip.frames, .placement = path.placement};
  out.side_tracks = all_side_tracks(clip, std::move(root.side_tracks));
  const auto n = static_cast<std::size_t>(out.frames);
  out.values.resize(static_cast<std::size_t>(reference.dimensions()) * n);
  path.write(root, out.values);
  const std::vector<int> joints = clip.skeleton.rotating_joints();
  std::vector<bool> jumps(n, false);
  std::vector<Eigen::Quaterniond> turns(n);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (j == 0) {
      for (std::size_t f = 0; f < n; ++f) turns[f] = path.without_heading(root_quaternion(root, f).normalized(), f);
    } else {
      unit_turns(clip, joints[j], turns);
    }
    const Eigen::Quaterniond from = reference.orientation(static_cast<int>(j)).conjugate();
    for (Eigen::Quaterniond& turn : turns) turn = from * turn;
    joint_parameters(turns, std::span(out.values).subspan((4 + 3 * j) * n, 3 * n), jumps);
  }
  for (std::size_t f = 1; f < n; ++f) {
    if (jumps[f]) out.jumps.push_back(static_cast<int>(f));
  }
  return out;
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
