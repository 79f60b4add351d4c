// The paper's own profile of the RMA codec (lin2011, sections 3 to 5): marker_encoder.h over a search for the target.
#pragma once

#include <memory>
#include <span>

#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

struct PaperSettings {
  double variance = 95;  // percent, where no target is given
  bool repeats = true;
  bool contacts = true;
  int primary_bits = 0;  // 0: adaptive
  int repeated_bits = 0;
};

[[nodiscard]] Bytes encode_paper_profile(std::span<const Clip> clips, const CodecTarget& target,
                                         const PaperSettings& settings, const Progress& progress);
[[nodiscard]] std::unique_ptr<StreamReader> open_paper_profile(Bitstream stream);

}  // namespace kinespace
