// The part of a BVH file before its numbers. For the reader only.
#pragma once

#include "motion/skeleton.h"
#include "motion/text.h"

namespace kinespace {

struct BvhHeader {
  Skeleton skeleton;
  int frames = 0;
  double rate_hz = 0;
  const char* data = nullptr;  // where the first frame's line may start
};

// Throws Error{bad_input}.
[[nodiscard]] BvhHeader parse_bvh_header(const TextSource& source);

}  // namespace kinespace
