#include "kinespace/footskate/detail/leg_pose.h"

#include <algorithm>

#include "kinespace/footskate/detail/knee_bends.h"
#include "kinespace/footskate/two_bone_ik.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double unmoved_cm = 1e-7;

Quaterniond from_vector(const Vector3d& turn) {
  const double angle = turn.norm();
  return angle > 0 ? Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) : Quaterniond::Identity();
}

void shift_root(Clip& clip, const Feet& feet, const std::vector<Vector3d>& shift) {
  bool moves = false;
  for (const Vector3d& s : shift) moves = moves || s.norm() > unmoved_cm;
  if (!moves) return;
  const int parent = clip.skeleton.joints[feet.root].parent;
  std::vector<JointFrame> frames;
  auto& track = clip.require_translation_track(feet.root);
  for (int f = 0; f < clip.frames; ++f) {
    if (shift[f].norm() <= unmoved_cm) continue;
    Vector3d local = shift[f];
    if (parent >= 0) {
      world_frames(clip, f, frames);
      local = frames[parent].rotation.conjugate() * local;
    }
    track.values[f] += local;
  }
}

// Sets the local rotation of a joint so that its world rotation is `world`, that of its parent being `parent`.
void set_world(Clip& clip, int joint, int frame, const Quaterniond& parent, const Quaterniond& world) {
  Quaterniond local = (parent.conjugate() * world).normalized();
  if (local.coeffs().dot(clip.rotation(joint, frame).coeffs()) < 0) local.coeffs() *= -1;
  clip.set_rotation(joint, frame, local);
}

class LegPoser {
 public:
  LegPoser(Clip& clip, const Leg& leg) : clip_(clip), leg_(leg), axis_(mean_knee_axis(clip, leg)) {}

  // How the leg bends and shall reach at a frame.
  [[nodiscard]] LegWish wish(const Vector3d& target, const std::vector<JointFrame>& w) const {
    const TwoBoneLimb limb = limb_of(w);
    const KneeHinge hinge = knee_hinge(limb, w[leg_.hip].rotation * axis_);
    return {.hinge = hinge,
            .reach = soft_reach((target - limb.hip).norm(), limb.reach(), limb.length()),
            .changes = (target - limb.ankle).norm() > unmoved_cm};
  }

  // The ankle in the direction of the target, the knee bent as said.
  void pose(int frame, const Vector3d& target, double bend, const Vector3d& foot_turn, std::vector<JointFrame>& w) {
    const TwoBoneLimb limb = limb_of(w);
    if ((target - limb.ankle).norm() <= unmoved_cm && foot_turn.norm() <= 1e-9) return;
    const KneeHinge hinge = knee_hinge(limb, w[leg_.hip].rotation * axis_);
    const TwoBoneTurn turn = bend_towards(limb, hinge, bend, target);
    set_world(clip_, leg_.hip, frame, parent(leg_.hip, w), turn.thigh * w[leg_.hip].rotation);
    set_world(clip_, leg_.knee, frame, turn.thigh * parent(leg_.knee, w), turn.shin * w[leg_.knee].rotation);
    set_world(clip_, leg_.ankle, frame, turn.shin * parent(leg_.ankle, w),
              from_vector(foot_turn) * w[leg_.ankle].rotation);
  }

 private:
  [[nodiscard]] TwoBoneLimb limb_of(const std::vector<JointFrame>& w) const {
    return {w[leg_.hip].position, w[leg_.knee].position, w[leg_.ankle].position};
  }
  [[nodiscard]] Quaterniond parent(int joint, const std::vector<JointFrame>& w) const {
    const int above = clip_.skeleton.joints[joint].parent;
    return above >= 0 ? w[above].rotation : Quaterniond::Identity();
  }

  Clip& clip_;
  Leg leg_;
  Vector3d axis_;  // in the frame of the hip joint
};

}  // namespace

Vector3d mean_knee_axis(const Clip& clip, const Leg& leg) {
  std::vector<JointFrame> w;
  Vector3d sum = Vector3d::Zero();
  for (int f = 0; f < clip.frames; ++f) {
    world_frames(clip, f, w);
    sum +=
        w[leg.hip].rotation.conjugate() * knee_bend({w[leg.hip].position, w[leg.knee].position, w[leg.ankle].position});
  }
  return sum.norm() > 1e-9 ? sum.normalized() : Vector3d::Zero();
}

void pose_legs(Clip& clip, const Feet& feet, const LegGoals& goals) {
  shift_root(clip, feet, goals.root_shift);
  std::array<LegPoser, 2> posers = {LegPoser(clip, feet.legs[0]), LegPoser(clip, feet.legs[1])};
  std::array<std::vector<LegWish>, 2> wishes;
  std::vector<JointFrame> world;
  for (int f = 0; f < clip.frames; ++f) {
    world_frames(clip, f, world);
    for (int side = 0; side < 2; ++side) wishes[side].push_back(posers[side].wish(goals.sides[side].ankle[f], world));
  }
  const std::array<std::vector<double>, 2> bends = {bends_for(wishes[0], clip.rate_hz, goals.give_cm),
                                                    bends_for(wishes[1], clip.rate_hz, goals.give_cm)};
  for (int f = 0; f < clip.frames; ++f) {
    world_frames(clip, f, world);
    for (int side = 0; side < 2; ++side) {
      posers[side].pose(f, goals.sides[side].ankle[f], bends[side][f], goals.sides[side].foot_turn[f], world);
    }
  }
}

LegTracks::LegTracks(const Clip& clip, const Feet& feet)
    : joints_{feet.legs[0].hip, feet.legs[0].knee, feet.legs[0].ankle,
              feet.legs[1].hip, feet.legs[1].knee, feet.legs[1].ankle},
      root_joint_(feet.root) {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const auto track = clip.rotation_track(joints_[i]);
    rotations_[i].assign(track.begin(), track.end());
  }
  if (const auto* track = clip.translation_track(root_joint_)) root_ = track->values;
}

void LegTracks::put_back(Clip& clip) const {
  write(clip, 0);
}

Clip LegTracks::slice_before(const Clip& now, int first, int count) const {
  Clip out = slice(now, first, count);
  write(out, first);
  return out;
}

void LegTracks::write(Clip& clip, int first) const {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const auto track = clip.rotation_track(joints_[i]);
    std::copy_n(rotations_[i].begin() + 4 * static_cast<std::ptrdiff_t>(first), track.size(), track.begin());
  }
  if (root_.empty()) {
    std::erase_if(clip.translations, [&](const auto& track) { return track.joint == root_joint_; });
  } else {
    auto& values = clip.require_translation_track(root_joint_).values;
    std::copy_n(root_.begin() + first, values.size(), values.begin());
  }
}

}  // namespace kinespace
