// From decoded markers and alignment to a clip: what the streams of markers share.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "kinespace/codecs/rma/contact_trajectories.h"
#include "kinespace/codecs/rma/markers.h"
#include "kinespace/codecs/rma/root_alignment.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/codecs/stream/clip_table.h"

namespace kinespace {

// Writes the posture that `markers(frame, out)` gives for every frame, in rising order, in the frames of `alignment`.
// `with_joints`: it gives where the joints are, too, behind the markers.
[[nodiscard]] Clip clip_from_markers(const ClipEntry& entry, const Skeleton& skeleton, const MarkerRig& rig,
                                     const ReferencePose& reference, const RootAlignment& alignment,
                                     const std::function<void(int, std::span<double>)>& markers,
                                     bool with_joints = false);

// The table of clips as streams of markers have it: names, skeletons, rates, lengths, placements, side tracks.
[[nodiscard]] ClipTable marker_clip_table(std::span<const Clip> clips, const AlignedClips& aligned);

}  // namespace kinespace
