// From choices in self-distance tables to clips of frames. Private to this folder.
#pragma once

#include <span>
#include <vector>

#include "kinespace/repeats/repeats.h"

namespace kinespace {

// One self-distance table and what it was made from.
struct GroupTable {
  int group = 0;
  const GroupSpace& space;
  const SelfDistance& distances;
};

class ClipCollector {
 public:
  // Unique clips shorter than `shortest_s` are merged with a neighbour where there is one.
  ClipCollector(const FrameTable& table, double shortest_s);

  void add(const GroupTable& in, std::span<const PrimaryChoice> choices);
  void add_unique(int group, std::span<const FrameSpan> ranges);

  // All clips, in time.
  [[nodiscard]] std::vector<RepeatClip> finish() &&;

 private:
  void add_run(int group, FrameSpan range, std::vector<RepeatClip> held);

  [[nodiscard]] std::vector<RepeatClip> clips_of(const GroupTable& in, const PrimaryChoice& choice) const;

  const FrameTable& table_;
  std::int64_t shortest_;
  std::vector<RepeatClip> clips_;     // until finish(), `primary` of primary and repeated clips is an index of
  std::vector<FrameSpan> primaries_;  // these: primary clips as they were chosen
};

}  // namespace kinespace
