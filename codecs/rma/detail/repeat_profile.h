// The default profile of the RMA codec: repeats found as the paper finds them, coded in the motion-space codec's
// functions (repeat_stream.h) over a search for the target.
#pragma once

#include <memory>
#include <span>

#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

struct RepeatSettings {
  double step = 15;  // of the quantiser, where no target is given: cm times the root of the joints
  bool repeats = true;
  bool contacts = true;
};

[[nodiscard]] Bytes encode_repeat_profile(std::span<const Clip> clips, const CodecTarget& target,
                                          const RepeatSettings& settings, const Progress& progress);
[[nodiscard]] std::unique_ptr<StreamReader> open_repeat_profile(Bitstream stream);

}  // namespace kinespace
