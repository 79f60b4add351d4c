// The part of a BVH file before its numbers. For the reader only.
#pragma once

#include "kinespace/motion/clip.h"
#include "kinespace/motion/text.h"

namespace kinespace {

struct BvhHeader {
  Skeleton skeleton;
  int frames = 0;
  double rate_hz = 0;
  const char* data = nullptr;  // where the first frame's line may start
};

// Throws Error{bad_input}, also where it is longer than the window of the source (motion/text.h: 16 MiB).
[[nodiscard]] BvhHeader parse_bvh_header(const TextSource& source);

// The whole file: what parse_bvh and read_bvh are made of.
[[nodiscard]] Clip parse_bvh(TextSource& source);

}  // namespace kinespace
