#include "kinespace/motion/kinematics.h"

#include <algorithm>
#include <array>

#include "kinespace/motion/position_blocks.h"
#include "kinespace/motion/simd.h"

namespace kinespace {
namespace {

constexpr int frame_block =
    32;  // frames; the world frames of a skeleton at a block's frames stay in the second-level cache

// One number of one joint at the frames of a block.
using Lane = std::array<double, frame_block>;

struct WorldBlock {
  alignas(64) Lane w, x, y, z;  // rotation, joint to world
  alignas(64) Lane px, py, pz;  // position, cm
};

struct LocalBlock {
  alignas(64) Lane w, x, y, z;
  alignas(64) Lane tx, ty, tz;
};

void load(const Clip& clip, int joint, const Clip::TranslationTrack* track, int first, int count, LocalBlock& out) {
  const double* q = clip.rotation_track(joint).data() + static_cast<std::size_t>(first) * 4;
  for (std::ptrdiff_t f = 0; f < count; ++f) {
    out.w[f] = q[4 * f];
    out.x[f] = q[4 * f + 1];
    out.y[f] = q[4 * f + 2];
    out.z[f] = q[4 * f + 3];
  }
  if (track == nullptr) {
    const Eigen::Vector3d& offset = clip.skeleton.joints[static_cast<std::size_t>(joint)].offset;
    out.tx.fill(offset.x());
    out.ty.fill(offset.y());
    out.tz.fill(offset.z());
    return;
  }
  const Eigen::Vector3d* t = track->values.data() + first;
  for (int f = 0; f < count; ++f) {
    out.tx[f] = t[f].x();
    out.ty[f] = t[f].y();
    out.tz[f] = t[f].z();
  }
}

// child = parent * T(t) * R(q), for a whole block: frames past the end hold what was there and are not used.
KINESPACE_VECTOR_CLONES
void chain(const WorldBlock& __restrict parent, const LocalBlock& __restrict local, WorldBlock& __restrict child) {
  for (int f = 0; f < frame_block; ++f) {
    const double w = parent.w[f], x = parent.x[f], y = parent.y[f], z = parent.z[f];
    const double tx = local.tx[f], ty = local.ty[f], tz = local.tz[f];
    const double ux = 2 * (y * tz - z * ty), uy = 2 * (z * tx - x * tz), uz = 2 * (x * ty - y * tx);
    child.px[f] = parent.px[f] + (tx + w * ux + (y * uz - z * uy));
    child.py[f] = parent.py[f] + (ty + w * uy + (z * ux - x * uz));
    child.pz[f] = parent.pz[f] + (tz + w * uz + (x * uy - y * ux));
  }
  for (int f = 0; f < frame_block; ++f) {
    const double w = parent.w[f], x = parent.x[f], y = parent.y[f], z = parent.z[f];
    const double a = local.w[f], b = local.x[f], c = local.y[f], d = local.z[f];
    child.w[f] = w * a - x * b - y * c - z * d;
    child.x[f] = w * b + x * a + y * d - z * c;
    child.y[f] = w * c + y * a + z * b - x * d;
    child.z[f] = w * d + z * a + x * c - y * b;
  }
}

std::vector<const Clip::TranslationTrack*> tracks_by_joint(const Clip& clip) {
  std::vector<const Clip::TranslationTrack*> out(clip.skeleton.joints.size(), nullptr);
  for (const auto& track : clip.translations) out[static_cast<std::size_t>(track.joint)] = &track;
  return out;
}

}  // namespace

void world_frames(const Clip& clip, int frame, std::vector<JointFrame>& out) {
  const auto count = clip.skeleton.joints.size();
  out.resize(count);
  auto track = clip.translations.begin();  // by joint, ascending: walked along with the joints
  for (std::size_t j = 0; j < count; ++j) {
    const Joint& joint = clip.skeleton.joints[j];
    const bool moves = track != clip.translations.end() && static_cast<std::size_t>(track->joint) == j;
    const Eigen::Vector3d& t = moves ? (track++)->values[static_cast<std::size_t>(frame)] : joint.offset;
    const Eigen::Quaterniond q = clip.rotation(static_cast<int>(j), frame);
    if (joint.parent < 0) {
      out[j] = {q, t};
    } else {
      const JointFrame& parent = out[static_cast<std::size_t>(joint.parent)];
      out[j] = {parent.rotation * q, parent.position + parent.rotation * t};
    }
  }
}

void positions_of_frames(const Clip& clip, int first, int count, JointPositions& out) {
  out.frames = count;
  out.joints = clip.skeleton.joint_count();
  const auto joints = static_cast<std::size_t>(out.joints);
  out.values.resize(static_cast<std::size_t>(out.frames) * joints);
  const auto tracks = tracks_by_joint(clip);
  std::vector<WorldBlock> world(joints);
  WorldBlock origin{};
  origin.w.fill(1);
  LocalBlock local{};
  for (int done = 0; done < count; done += frame_block) {
    const int some = std::min(frame_block, count - done);
    for (std::size_t j = 0; j < joints; ++j) {
      const int parent = clip.skeleton.joints[j].parent;
      load(clip, static_cast<int>(j), tracks[j], first + done, some, local);
      WorldBlock& here = world[j];
      chain(parent < 0 ? origin : world[static_cast<std::size_t>(parent)], local, here);
      Eigen::Vector3d* to = out.values.data() + static_cast<std::size_t>(done) * joints + j;
      for (int f = 0; f < some; ++f, to += joints) *to = {here.px[f], here.py[f], here.pz[f]};
    }
  }
}

JointPositions joint_positions(const Clip& clip) {
  JointPositions out;
  positions_of_frames(clip, 0, clip.frames, out);
  return out;
}

void for_each_position_block(const Clip& clip, int overlap,
                             const std::function<void(int first, const JointPositions&)>& visit) {
  JointPositions block;
  for (int next = 0; next < clip.frames; next += position_block_frames) {
    const int first = std::max(0, next - overlap);
    positions_of_frames(clip, first, std::min(clip.frames, next + position_block_frames) - first, block);
    visit(first, block);
  }
}

}  // namespace kinespace
