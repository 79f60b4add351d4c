// The sample clips and streams of them, made once.
#pragma once

#include <algorithm>
#include <vector>

#include "examples/sample_motions.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/codecs/stream/clip_error.h"

namespace kinespace::test {

inline const std::vector<Clip>& sample_clips() {
  static const std::vector<Clip> clips = [] {
    std::vector<Clip> out;
    for (const SampleMotion& motion : sample_library({.takes = 1})) out.push_back(motion.clip);
    out.resize(std::min<std::size_t>(out.size(), 16));
    return out;
  }();
  return clips;
}

// At half a centimetre.
inline const Bytes& sample_stream() {
  static const Bytes stream = encode("motion-space", sample_clips(), {.target = {.mean_error_cm = 0.5}});
  return stream;
}

inline ClipErrorSums error_of(const std::vector<Clip>& originals, const std::vector<Clip>& decoded) {
  ClipErrorSums out;
  for (std::size_t c = 0; c < originals.size(); ++c) {
    out.add(clip_error(originals[c], decoded[c], 0, originals[c].frames, 0));
  }
  return out;
}

// Equal to the last bit.
inline bool same(const Clip& a, const Clip& b) {
  if (a.name != b.name || a.frames != b.frames || a.rate_hz != b.rate_hz || a.rotations != b.rotations) return false;
  if (a.translations.size() != b.translations.size()) return false;
  for (std::size_t t = 0; t < a.translations.size(); ++t) {
    if (a.translations[t].joint != b.translations[t].joint || a.translations[t].values != b.translations[t].values) {
      return false;
    }
  }
  return true;
}

}  // namespace kinespace::test
