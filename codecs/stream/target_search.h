// The search for one number, a coarseness, with which a codec meets a target: error and size both follow it. All codecs of
// clips that can lose something meet their targets by it, but for the errors of motion-space, which moves two numbers at once.
#pragma once

#include <functional>

#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/measured_stream.h"

namespace kinespace {

struct SearchRange {
  double start = 1;
  double least = 1e-4;
  double most = 1e3;
  int rounds = 9;        // attempts at most from the first that meets the target on; twice as many in all
  double close = 0.985;  // an error or size within this share of the target ends the search
};

// The smallest stream found (for a target in bytes: the largest, which is off least) that meets the target; the coarseness
// at which errors grow and streams shrink need not be exact. Throws Error{usage} when none does.
[[nodiscard]] Bytes search_target(const CodecTarget& target, const SearchRange& range,
                                  const std::function<CodedAttempt(double coarseness)>& attempt);

}  // namespace kinespace
