// The search for one number, a coarseness, with which a codec meets a target: error and size both follow it.
#pragma once

#include <functional>

#include "kinespace/base/bytes.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/storage/bitstream.h"

namespace kinespace {

struct CodedAttempt {
  Bytes stream;
  MeasuredError error;
};

struct SearchRange {
  double start = 1;
  double least = 1e-4;
  double most = 1e3;
  int rounds = 9;        // attempts at most, while none meets the target
  double close = 0.975;  // an error or size within this share of the target ends the search
};

// The smallest stream found (for a target in bytes: the one of least error) that meets the target; the coarseness at
// which errors grow and streams shrink need not be exact. Throws Error{usage} when none does.
[[nodiscard]] Bytes search_target(const CodecTarget& target, const SearchRange& range,
                                  const std::function<CodedAttempt(double coarseness)>& attempt);

}  // namespace kinespace
