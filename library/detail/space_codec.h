// Motion spaces, encoded clips and clips made ready as bytes: bitstreams (storage/bitstream.h) with checksums, versions
// and every size checked before it is believed. All of it throws Error{bad_input} naming `source`.
//
// The vectors of a clip are stored level of detail by level of detail, each a block of its own with its own checksum: any
// prefix is a valid, coarser clip. The ends that neighbouring sequences share are kept once, in the first block. Scores are kept in steps of `score_step`: half a step is
// the largest error of a score, 5e-5 of a quaternion's length, which is 0.005 cm at the end of an arm.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "kinespace/base/bytes.h"
#include "kinespace/fpca/encoding.h"
#include "kinespace/fpca/registered_space.h"

namespace kinespace {

inline constexpr double score_step = 1e-4;  // over the root of a set's pace: more scores add up to no more error

[[nodiscard]] Bytes pack_skeleton(const Skeleton& skeleton);
[[nodiscard]] Skeleton unpack_skeleton(std::span<const std::byte> bytes, const std::string& source);

// pack_space and unpack_space are declared with MotionSpace and RegisteredSpace.

// The three blobs of a clip in a library.
struct PackedClip {
  Bytes vectors;  // the scores
  Bytes warps;    // where the sequences lie and how time runs in them
  Bytes side;     // where the clip stands, what each sequence travels, side tracks, errors of levels, feet
};
[[nodiscard]] PackedClip pack_clip(const EncodedClip& clip, const RegisteredSpace& space);
// What the clip is after pack_clip and unpack_clip: its scores are in the steps that they are stored in.
void round_to_stored(EncodedClip& clip, const RegisteredSpace& space);
// At level of detail `functions` at most (all when < 0), of a stream that may end early. `header` gives name, rate and
// frames.
[[nodiscard]] EncodedClip unpack_clip(const PackedClip& packed, const RegisteredSpace& space, const Skeleton& skeleton,
                                      const EncodedClip& header, const std::string& source, int functions = -1);

// What `side` says of a clip's levels of detail alone; empty where they were not measured.
[[nodiscard]] std::vector<LevelError> unpack_level_errors(std::span<const std::byte> side, const RegisteredSpace& space,
                                                          const std::string& source);

// What `side` keeps of a clip's feet alone.
[[nodiscard]] std::optional<KeptFeet> unpack_clip_feet(std::span<const std::byte> side, int frames,
                                                       const Skeleton& skeleton, const std::string& source);

}  // namespace kinespace
