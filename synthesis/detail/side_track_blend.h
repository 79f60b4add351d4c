// What the curves of a clip do not carry (side tracks: joints above the root, translations), blended as they are.
#pragma once

#include <span>
#include <vector>

#include "kinespace/motion/curves.h"

namespace kinespace {

// One clip's part in a frame that is made of several.
struct FramePart {
  std::size_t clip = 0;
  double time_s = 0;
  double weight = 1;
};

// The side tracks of a clip of which frame f is the weighted mean of `parts[f]`: translations linearly, rotations by
// their normalised mean. A clip without a track that another has counts as the joint's rest.
[[nodiscard]] std::vector<SideTrack> blend_side_tracks(std::span<const ClipCurves> clips,
                                                       std::span<const std::vector<FramePart>> parts,
                                                       const Skeleton& skeleton);

}  // namespace kinespace
