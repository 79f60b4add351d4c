#include "kinespace/codecs/rma/marker_clips.h"

#include <algorithm>
#include <array>

namespace kinespace {
namespace {

// Puts the root where it shall be in the world, through the joints above it.
class RootWriter {
 public:
  RootWriter(Clip& clip, int root) : clip_(clip), root_(root) {
    for (int j = clip.skeleton.joints[static_cast<std::size_t>(root)].parent; j >= 0;
         j = clip.skeleton.joints[static_cast<std::size_t>(j)].parent) {
      above_.insert(above_.begin(), j);
    }
    clip.require_translation_track(root);
    travel_ = &clip.translation_track(root)->values;
  }
  void write(int frame, const Eigen::Vector3d& position, const Eigen::Quaterniond& rotation) {
    Eigen::Vector3d base = Eigen::Vector3d::Zero();
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    for (const int j : above_) {
      base += turn * clip_.translation(j, frame);
      turn = turn * clip_.rotation(j, frame);
    }
    (*travel_)[static_cast<std::size_t>(frame)] = turn.conjugate() * (position - base);
    clip_.set_rotation(root_, frame, turn.conjugate() * rotation);
  }

 private:
  Clip& clip_;
  int root_;
  std::vector<int> above_;
  std::vector<Eigen::Vector3d>* travel_ = nullptr;
};

}  // namespace

Clip clip_from_markers(const ClipEntry& entry, const Skeleton& skeleton, const MarkerRig& rig,
                       const ReferencePose& reference, const RootAlignment& alignment,
                       const std::function<void(int, std::span<double>)>& markers, bool with_joints) {
  Clip out = make_clip(entry.name, skeleton, entry.rate_hz, entry.frames);
  const std::vector<int> joints = skeleton.rotating_joints();
  out.require_translation_track(joints.front());
  for (const SideTrack& track : entry.side_tracks) apply_side_track(track, 0, out);
  RootWriter root(out, joints.front());
  const Eigen::Vector3d start = entry.placement.start_cm();
  const Eigen::Quaterniond turn = entry.placement.turn();
  const auto d = static_cast<std::size_t>(rig.dimensions());
  std::vector<double> values(d + (with_joints ? 3 * joints.size() : 0));
  std::vector<Eigen::Quaterniond> rotations(joints.size());
  MarkerRig::Scratch scratch;
  std::vector<double*> tracks;
  tracks.reserve(joints.size());
  for (const int j : joints) tracks.push_back(out.rotation_track(j).data());
  const auto curves = static_cast<std::size_t>(RootAlignment::curve_count(alignment.degrees));
  std::array<double, 7> at{};
  for (int f = 0; f < entry.frames; ++f) {
    markers(f, values);
    for (std::size_t c = 0; c < curves; ++c) at[c] = alignment.curve(static_cast<int>(c))[static_cast<std::size_t>(f)];
    const RigidFrame frame = alignment_frame(std::span(at).first(curves), reference);
    rig.rotations(std::span(values).first(d), scratch, rotations, std::span(values).subspan(d));
    for (std::size_t j = 1; j < joints.size(); ++j) {
      const Eigen::Quaterniond& q = rotations[j];
      double* to = tracks[j] + 4 * static_cast<std::size_t>(f);
      to[0] = q.w(), to[1] = q.x(), to[2] = q.y(), to[3] = q.z();
    }
    const Eigen::Vector3d place = frame.position + frame.turn * Eigen::Vector3d(values[0], values[1], values[2]);
    root.write(f, start + turn * place, turn * (frame.turn * rotations[0]));
  }
  return out;
}

ClipTable marker_clip_table(std::span<const Clip> clips, const AlignedClips& aligned) {
  ClipTable out;
  for (std::size_t c = 0; c < clips.size(); ++c) {
    const Clip& clip = clips[c];
    ClipEntry entry{.name = clip.name,
                    .skeleton = out.add_skeleton(clip.skeleton, clip.name),
                    .rate_hz = clip.rate_hz,
                    .frames = clip.frames,
                    .placement = aligned.vectors[c].placement,
                    .blocks = {},
                    .finer = {},
                    .side_tracks = aligned.vectors[c].side_tracks};
    entry.cut_evenly();
    out.clips.push_back(std::move(entry));
  }
  return out;
}

}  // namespace kinespace
