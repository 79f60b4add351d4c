// Clips as long as a test wants them.
#pragma once

#include "kinespace/motion/clip.h"

namespace kinespace::test {

// The motion over and over, for so many frames.
inline Clip over_and_over(const Clip& once, int frames) {
  Clip out = make_clip(once.name, once.skeleton, once.rate_hz, frames);
  for (int j = 0; j < once.skeleton.joint_count(); ++j) {
    for (int f = 0; f < frames; ++f) out.set_rotation(j, f, once.rotation(j, f % once.frames));
  }
  for (const auto& track : once.translations) {
    auto& values = out.require_translation_track(track.joint).values;
    for (int f = 0; f < frames; ++f) {
      values[static_cast<std::size_t>(f)] = track.values[static_cast<std::size_t>(f % once.frames)];
    }
  }
  return out;
}

}  // namespace kinespace::test
