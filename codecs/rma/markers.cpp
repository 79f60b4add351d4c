#include "kinespace/codecs/rma/markers.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/stream/clip_table.h"

namespace kinespace {
namespace {

constexpr double marker_cm = 5;  // of markers that stand for no joint
constexpr double middling_bone_cm = 10;
constexpr double long_bone_cm = 22;
constexpr double short_bone_cm = 2;  // what cannot tell a direction well

// The axes of a bone: along it, the part of `across` at right angles to it, and both's normal. False for none.
bool axes_of(const Eigen::Vector3d& along, const Eigen::Vector3d& across, Eigen::Matrix3d& axes) {
  constexpr double least = 1e-9;
  const double length = std::sqrt(along.x() * along.x() + along.y() * along.y() + along.z() * along.z());
  if (!(length > least)) return false;
  const Eigen::Vector3d first = along / length;
  const double shadow = across.x() * first.x() + across.y() * first.y() + across.z() * first.z();
  const Eigen::Vector3d rest = across - shadow * first;
  const double width = std::sqrt(rest.x() * rest.x() + rest.y() * rest.y() + rest.z() * rest.z());
  if (!(width > least)) return false;
  const Eigen::Vector3d second = rest / width;
  axes.col(0) = first;
  axes.col(1) = second;
  axes.col(2) = first.cross(second);
  return true;
}

// Joints that turn with rotating joint `owner` and nothing else, as points in its frame, without its own.
struct RigidPoints {
  std::vector<Eigen::Vector3d> joints;
  std::vector<Eigen::Vector3d> ends;
};

Eigen::Vector3d farthest_of(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) {
    if (p.norm() > out.norm() * (1 + 1e-9)) out = p;
  }
  return out;
}

Eigen::Vector3d choose_along(const RigidPoints& points) {
  Eigen::Vector3d joint = farthest_of(points.joints);
  if (joint.norm() >= short_bone_cm) return joint;
  Eigen::Vector3d direction = joint.norm() > 1e-3 ? joint : farthest_of(points.ends);
  if (direction.norm() < 1e-3) direction = Eigen::Vector3d::UnitY();
  return marker_cm * direction.normalized();
}

Eigen::Vector3d choose_across(const RigidPoints& points, const Eigen::Vector3d& along) {
  const Eigen::Vector3d axis = along.normalized();
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points.joints) {
    const Eigen::Vector3d off = p - p.dot(axis) * axis;
    if (off.norm() > best.norm() * (1 + 1e-9)) best = off;
  }
  if (best.norm() < 1e-3) {
    // Any direction at right angles: from the axis of space that the bone is farthest from.
    Eigen::Index smallest = 0;
    axis.cwiseAbs().minCoeff(&smallest);
    const Eigen::Vector3d other = Eigen::Vector3d::Unit(smallest);
    best = other - other.dot(axis) * axis;
  }
  return std::max(marker_cm, best.norm()) * best.normalized();
}

}  // namespace

MarkerRig::MarkerRig(const Skeleton& skeleton) {
  const std::vector<int> rotating = skeleton.rotating_joints();
  const std::size_t n = skeleton.joints.size();
  std::vector<int> owner(n, -1);                                        // rotating joint that moves a joint's children
  std::vector<Eigen::Vector3d> from_owner(n, Eigen::Vector3d::Zero());  // the joint's place in its owner's frame
  std::vector<RigidPoints> points(rotating.size());
  bones_.resize(rotating.size());
  std::size_t next = 0;
  for (std::size_t j = 0; j < n; ++j) {
    const Joint& joint = skeleton.joints[j];
    const int parent = joint.parent;
    const int above = parent < 0 ? -1 : owner[static_cast<std::size_t>(parent)];
    const Eigen::Vector3d place = above < 0
                                      ? Eigen::Vector3d::Zero()
                                      : Eigen::Vector3d(from_owner[static_cast<std::size_t>(parent)] + joint.offset);
    if (above >= 0) points[static_cast<std::size_t>(above)].joints.push_back(place);
    if (next < rotating.size() && rotating[next] == static_cast<int>(j)) {
      owner[j] = static_cast<int>(next);
      bones_[next].parent = above;
      bones_[next].offset = place;
      ++next;
    } else {
      owner[j] = above;
      from_owner[j] = place;
    }
    if (owner[j] >= 0 && joint.end_site) {
      points[static_cast<std::size_t>(owner[j])].ends.emplace_back(from_owner[j] + *joint.end_site);
    }
  }
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    Bone& bone = bones_[b];
    bone.along = choose_along(points[b]);
    bone.across = choose_across(points[b], bone.along);
    bone.trust = std::clamp((long_bone_cm - bone.along.norm()) / (long_bone_cm - middling_bone_cm), 0.0, 1.0);
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    axes_of(bone.along, bone.across, axes);
    bone.back = axes.transpose();
  }
}

void MarkerRig::place(const Eigen::Vector3d& root, std::span<const Eigen::Quaterniond> rotations, Scratch& scratch,
                      std::span<double> markers, std::span<double> own) const {
  auto& [turn, at] = scratch;
  turn.resize(bones_.size());
  at.resize(bones_.size());
  for (std::size_t k = 0; k < 3; ++k) markers[k] = root[static_cast<Eigen::Index>(k)];
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const Bone& bone = bones_[b];
    const auto parent = static_cast<std::size_t>(bone.parent);
    const Eigen::Matrix3d local = rotations[b].toRotationMatrix();
    turn[b] = bone.parent < 0 ? local : Eigen::Matrix3d(turn[parent] * local);
    at[b] = bone.parent < 0 ? root : Eigen::Vector3d(at[parent] + turn[parent] * bone.offset);
    const Eigen::Vector3d along = at[b] + turn[b] * bone.along;
    const Eigen::Vector3d across = at[b] + turn[b] * bone.across;
    for (std::size_t k = 0; k < 3; ++k) {
      markers[3 + 6 * b + k] = along[static_cast<Eigen::Index>(k)];
      markers[6 + 6 * b + k] = across[static_cast<Eigen::Index>(k)];
      if (!own.empty()) own[3 * b + k] = at[b][static_cast<Eigen::Index>(k)];
    }
  }
}

void MarkerRig::rotations(std::span<const double> markers, Scratch& scratch, std::span<Eigen::Quaterniond> rotations,
                          std::span<const double> own) const {
  auto& [turn, at] = scratch;
  turn.resize(bones_.size());
  at.resize(bones_.size());
  const Eigen::Vector3d root(markers[0], markers[1], markers[2]);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const Bone& bone = bones_[b];
    const auto parent = static_cast<std::size_t>(bone.parent);
    at[b] = bone.parent < 0 ? root : Eigen::Vector3d(at[parent] + turn[parent] * bone.offset);
    const double* m = markers.data() + 3 + 6 * b;
    Eigen::Matrix3d axes;
    Eigen::Vector3d from = at[b];
    if (!own.empty()) {
      from = Eigen::Vector3d(own[3 * b], own[3 * b + 1], own[3 * b + 2]);
    } else if (bone.parent >= 0 && bone.trust > 0) {
      const Bone& above = bones_[parent];
      const double* p = markers.data() + 3 + 6 * parent;
      const Eigen::Vector3d shown = Eigen::Vector3d(p[0], p[1], p[2]) + turn[parent] * (bone.offset - above.along);
      from += bone.trust * (shown - from);
    }
    const bool told = axes_of(Eigen::Vector3d(m[0], m[1], m[2]) - from, Eigen::Vector3d(m[3], m[4], m[5]) - from, axes);
    if (told) {
      turn[b] = axes * bone.back;
    } else {
      turn[b] = bone.parent < 0 ? Eigen::Matrix3d::Identity() : turn[parent];
    }
    const Eigen::Matrix3d local = bone.parent < 0 ? turn[b] : Eigen::Matrix3d(turn[parent].transpose() * turn[b]);
    rotations[b] = Eigen::Quaterniond(local);
    rotations[b].normalize();
  }
}

AlignedClips align_clips(std::span<const Clip> clips) {
  AlignedClips out;
  ClipTable table;
  for (const Clip& clip : clips) {
    out.rig.push_back(table.add_skeleton(clip.skeleton, clip.name));
    out.rates_hz.push_back(clip.rate_hz);
  }
  for (const Skeleton& skeleton : table.skeletons) out.rigs.emplace_back(skeleton);
  if (clips.empty()) return out;
  out.rate_hz = clips.front().rate_hz;
  out.reference = reference_pose(clips);
  out.vectors.resize(clips.size());
  out.degrees.resize(clips.size());
  parallel_for(std::size_t{0}, clips.size(), [&](std::size_t c) {
    out.vectors[c] = pose_vectors(clips[c], out.reference);
    out.degrees[c] = alignment_degrees(out.vectors[c], out.reference);
  });
  return out;
}

void clip_markers(const AlignedClips& clips, std::size_t clip, const RootAlignment& alignment, int first, int count,
                  double* out, bool with_joints) {
  const PoseVectors& vectors = clips.vectors[clip];
  const MarkerRig& rig = clips.rigs[static_cast<std::size_t>(clips.rig[clip])];
  const auto frames = static_cast<std::size_t>(vectors.frames);
  const auto joints = static_cast<std::size_t>(rig.joint_count());
  const int curve_count = RootAlignment::curve_count(alignment.degrees);
  std::vector<Eigen::Quaterniond> reference;
  for (std::size_t j = 0; j < joints; ++j) reference.push_back(clips.reference.orientation(static_cast<int>(j)));
  std::vector<Eigen::Quaterniond> rotations(joints);
  MarkerRig::Scratch scratch;
  std::array<double, 7> at{};
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const std::size_t f = static_cast<std::size_t>(first) + i;
    for (int c = 0; c < curve_count; ++c) at[static_cast<std::size_t>(c)] = alignment.curve(c)[f];
    const RigidFrame frame =
        alignment_frame(std::span(at).first(static_cast<std::size_t>(curve_count)), clips.reference);
    const double* v = vectors.values.data() + f;
    for (std::size_t j = 0; j < joints; ++j) {
      const double* m = v + (4 + 3 * j) * frames;
      rotations[j] = reference[j] * from_rodrigues({m[0], m[frames], m[2 * frames]});
    }
    const std::array<double, 4> heading{0, 0, 0, v[3 * frames]};
    rotations[0] = frame.turn.conjugate() * (alignment_frame(heading, clips.reference).turn * rotations[0]);
    const Eigen::Vector3d root =
        frame.turn.conjugate() * (Eigen::Vector3d(v[0], v[frames], v[2 * frames]) - frame.position);
    const auto d = static_cast<std::size_t>(rig.dimensions());
    const std::size_t stride = d + (with_joints ? 3 * joints : 0);
    rig.place(root, rotations, scratch, {out + i * stride, d}, {out + i * stride + d, stride - d});
  }
}

FrameTable marker_table(const AlignedClips& clips) {
  FrameTable out{.rate_hz = clips.rate_hz, .dimensions = 0, .frames = 0, .values = {}, .starts = {}};
  if (clips.rigs.empty()) return out;
  out.dimensions = clips.rigs.front().dimensions();
  for (const PoseVectors& vectors : clips.vectors) {
    out.starts.push_back(out.frames);
    out.frames += vectors.frames;
  }
  const auto d = static_cast<std::size_t>(out.dimensions);
  out.values.resize(d * static_cast<std::size_t>(out.frames));
  parallel_for(std::size_t{0}, clips.vectors.size(), [&](std::size_t c) {
    // As doubles only some frames at a time.
    constexpr int block = 1024;
    const RootAlignment alignment = root_alignment(clips.vectors[c], clips.degrees[c]);
    const int blocks = (clips.vectors[c].frames + block - 1) / block;
    parallel_for(0, blocks, [&](int b) {
      const int first = b * block;
      const int count = std::min(block, clips.vectors[c].frames - first);
      std::vector<double> markers(d * static_cast<std::size_t>(count));
      clip_markers(clips, c, alignment, first, count, markers.data());
      std::ranges::transform(markers, out.values.begin() + static_cast<std::ptrdiff_t>(d) * (out.starts[c] + first),
                             [](double v) { return static_cast<float>(v); });
    });
  });
  return out;
}

FrameTable marker_table(std::span<const Clip> clips) {
  return marker_table(align_clips(clips));
}

}  // namespace kinespace
