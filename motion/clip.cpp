#include "kinespace/motion/clip.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace kinespace {

std::span<double> Clip::rotation_track(int joint) {
  const auto length = static_cast<std::size_t>(frames) * 4;
  return std::span<double>(rotations).subspan(static_cast<std::size_t>(joint) * length, length);
}

std::span<const double> Clip::rotation_track(int joint) const {
  const auto length = static_cast<std::size_t>(frames) * 4;
  return std::span<const double>(rotations).subspan(static_cast<std::size_t>(joint) * length, length);
}

Eigen::Quaterniond Clip::rotation(int joint, int frame) const {
  const double* q = rotation_track(joint).data() + static_cast<std::size_t>(frame) * 4;
  return {q[0], q[1], q[2], q[3]};
}

void Clip::set_rotation(int joint, int frame, const Eigen::Quaterniond& q) {
  double* out = rotation_track(joint).data() + static_cast<std::size_t>(frame) * 4;
  out[0] = q.w();
  out[1] = q.x();
  out[2] = q.y();
  out[3] = q.z();
}

const Clip::TranslationTrack* Clip::translation_track(int joint) const {
  const auto found = std::ranges::lower_bound(translations, joint, {}, &TranslationTrack::joint);
  return found != translations.end() && found->joint == joint ? &*found : nullptr;
}

Clip::TranslationTrack* Clip::translation_track(int joint) {
  return const_cast<TranslationTrack*>(std::as_const(*this).translation_track(joint));
}

Eigen::Vector3d Clip::translation(int joint, int frame) const {
  const TranslationTrack* track = translation_track(joint);
  return track != nullptr ? track->values[static_cast<std::size_t>(frame)]
                          : skeleton.joints[static_cast<std::size_t>(joint)].offset;
}

Clip::TranslationTrack& Clip::require_translation_track(int joint) {
  const auto found = std::ranges::lower_bound(translations, joint, {}, &TranslationTrack::joint);
  if (found != translations.end() && found->joint == joint) return *found;
  const auto& rest = skeleton.joints[static_cast<std::size_t>(joint)].offset;
  return *translations.insert(found, {joint, std::vector<Eigen::Vector3d>(static_cast<std::size_t>(frames), rest)});
}

Clip make_clip(std::string name, Skeleton skeleton, double rate_hz, int frames) {
  assert(rate_hz > 0 && frames >= 1);
  Clip clip{.name = std::move(name),
            .skeleton = std::move(skeleton),
            .rate_hz = rate_hz,
            .frames = frames,
            .rotations = {},
            .translations = {}};
  clip.rotations.assign(static_cast<std::size_t>(clip.skeleton.joint_count()) * static_cast<std::size_t>(frames) * 4,
                        0);
  for (std::size_t i = 0; i < clip.rotations.size(); i += 4) clip.rotations[i] = 1;
  return clip;
}

Clip slice(const Clip& clip, int first, int count) {
  assert(first >= 0 && count >= 1 && first + count <= clip.frames);
  Clip out = make_clip(clip.name, clip.skeleton, clip.rate_hz, count);
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    const auto from =
        clip.rotation_track(j).subspan(static_cast<std::size_t>(first) * 4, static_cast<std::size_t>(count) * 4);
    std::ranges::copy(from, out.rotation_track(j).begin());
  }
  for (const auto& track : clip.translations) {
    out.translations.push_back({track.joint, {track.values.begin() + first, track.values.begin() + first + count}});
  }
  return out;
}

}  // namespace kinespace
