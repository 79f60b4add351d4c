// What a stream of clips says about them beside their curves: skeletons, names, rates, lengths, placement, windows.
//
// Clips of one stream share a tree (Skeleton::same_tree); their bones may differ, equal skeletons are stored once.
// Offsets are kept as 32-bit floats (1e-6 cm). Everything goes through the adaptive coder: a clip among many of similar
// names costs some ten bytes.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "kinespace/codecs/stream/pose_vectors.h"

namespace kinespace {

inline constexpr int most_rotating_joints = 400;
inline constexpr int longest_block = 512;  // frames
inline constexpr int finest_block = 60;

struct ClipEntry {
  std::string name;
  int skeleton = 0;
  double rate_hz = 0;
  int frames = 0;
  CoarsePlacement placement;
  std::vector<int> blocks;  // lengths in frames, each 1 to longest_block, together `frames`
  std::vector<int> finer;   // by block: its quantiser step is the stream's over 2^(finer / 2); 0 to finest_block
  std::vector<SideTrack> side_tracks;

  // Blocks as long as may be, for codecs to which they mean nothing.
  void cut_evenly();
};

struct ClipTable {
  std::vector<Skeleton> skeletons;
  std::vector<ClipEntry> clips;

  [[nodiscard]] std::int64_t frames() const;
  // The number of the skeleton among `skeletons`, added when it is new. Throws Error{usage} naming `clip` when its tree
  // is another than that of the first.
  int add_skeleton(const Skeleton& skeleton, const std::string& clip);
};

// Of clips whose codec keeps their placement among its curves, and cuts them itself. Throws as add_skeleton does.
[[nodiscard]] ClipTable clip_table_of(std::span<const Clip> clips);

// `known`: skeletons that the reader has and that need no telling.
[[nodiscard]] Bytes pack_clip_table(const ClipTable& table, std::span<const Skeleton> known = {});
// Throws Error{bad_input} naming `source`. At most `most_frames` frames in all are believed. `known` must be what the
// table was packed with.
[[nodiscard]] ClipTable unpack_clip_table(std::span<const std::byte> bytes, std::int64_t most_frames,
                                          const std::string& source, std::span<const Skeleton> known = {});

// At least one, all of one tree.
[[nodiscard]] Bytes pack_skeletons(std::span<const Skeleton> skeletons);
[[nodiscard]] std::vector<Skeleton> unpack_skeletons(std::span<const std::byte> bytes, const std::string& source);

}  // namespace kinespace
