// Spaces of the sample motions, for tests: no data from elsewhere, and the truth is known.
#pragma once

#include <vector>

#include "examples/sample_motions.h"
#include "kinespace/fpca/space_builder.h"

namespace kinespace::test {

// One clip of each kind of sample motion, made ready.
inline const std::vector<Clip>& sample_clips() {
  static const std::vector<Clip> clips = [] {
    std::vector<Clip> out;
    for (SampleMotion& motion : sample_library({.takes = 1})) out.push_back(std::move(motion.clip));
    return out;
  }();
  return clips;
}

inline const std::vector<PreparedClip>& prepared_samples() {
  static const std::vector<PreparedClip> prepared = [] {
    std::vector<PreparedClip> out;
    for (const Clip& clip : sample_clips()) out.push_back(prepare(clip));
    return out;
  }();
  return prepared;
}

inline const BuiltSpace& sample_space() {
  static const BuiltSpace built = build_space(source_of(prepared_samples()), {});
  return built;
}

inline EncodedClip encode_sample(const BuiltSpace& built, std::size_t i) {
  ClipCurves curves = prepared_samples()[i].curves;
  built.space.apply_references(curves.values);
  return encode(built.space, curves, built.runs_of(static_cast<int>(i), prepared_samples()[i].runs), built.warps[i]);
}

}  // namespace kinespace::test
