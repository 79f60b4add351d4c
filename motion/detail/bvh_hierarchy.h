// The part of a BVH file before its numbers. For the reader only.
#pragma once

#include <vector>

#include "kinespace/motion/clip.h"
#include "kinespace/motion/read_options.h"
#include "kinespace/motion/text.h"

namespace kinespace {

struct BvhHeader {
  Skeleton skeleton;       // of several ROOTs: one behind the other, each with parent -1
  std::vector<int> roots;  // their joints
  int frames = 0;          // as "Frames:" says
  double rate_hz = 0;
  const char* data = nullptr;  // where the first frame's line may start
};

// Throws Error{bad_input}, also where it is longer than the window of the source (motion/text.h: 16 MiB).
[[nodiscard]] BvhHeader parse_bvh_header(const TextSource& source, const ClipReadOptions& options);

// The whole file: what the readers of motion/bvh.h are made of.
[[nodiscard]] std::vector<Clip> parse_bvh(TextSource& source, const ClipReadOptions& options);

}  // namespace kinespace
