#include "motion/kinematics.h"

namespace kinespace {
namespace {

// The tracks of a clip looked up once, so that the loop over frames does not search.
std::vector<const Clip::TranslationTrack*> tracks_by_joint(const Clip& clip) {
  std::vector<const Clip::TranslationTrack*> out(clip.skeleton.joints.size(), nullptr);
  for (const auto& track : clip.translations) out[static_cast<std::size_t>(track.joint)] = &track;
  return out;
}

void world_frames(const Clip& clip, const std::vector<const Clip::TranslationTrack*>& tracks, int frame,
                  std::vector<JointFrame>& out) {
  const auto count = clip.skeleton.joints.size();
  out.resize(count);
  for (std::size_t j = 0; j < count; ++j) {
    const Joint& joint = clip.skeleton.joints[j];
    const Eigen::Vector3d& t = tracks[j] != nullptr ? tracks[j]->values[static_cast<std::size_t>(frame)] : joint.offset;
    const Eigen::Quaterniond q = clip.rotation(static_cast<int>(j), frame);
    if (joint.parent < 0) {
      out[j] = {q, t};
    } else {
      const JointFrame& parent = out[static_cast<std::size_t>(joint.parent)];
      out[j] = {parent.rotation * q, parent.position + parent.rotation * t};
    }
  }
}

}  // namespace

void world_frames(const Clip& clip, int frame, std::vector<JointFrame>& out) {
  world_frames(clip, tracks_by_joint(clip), frame, out);
}

JointPositions joint_positions(const Clip& clip) {
  JointPositions out{clip.frames, clip.skeleton.joint_count(), {}};
  out.values.reserve(static_cast<std::size_t>(out.frames) * static_cast<std::size_t>(out.joints));
  const auto tracks = tracks_by_joint(clip);
  std::vector<JointFrame> frames;
  for (int f = 0; f < clip.frames; ++f) {
    world_frames(clip, tracks, f, frames);
    for (const JointFrame& joint : frames) out.values.push_back(joint.position);
  }
  return out;
}

}  // namespace kinespace
