// The RMA codec: repeated motion is found and coded once (lin2011).
//
//   clips -> root alignment -> postures -> behaviour groups -> primary, repeated and unique clips (repeats.h)
//
// A repeated clip is coded as what its primary clip, as decoded, leaves of it. Two profiles:
//
//   paper (--profile paper)   the paper's rules: principal components of virtual markers per group, Catmull-Rom control
//                             points with adaptive bits, contacts with inverse kinematics (paper_profile.h)
//   default                   the same repetitions, predicted in the motion-space codec's functions, basis and coder
//                             (repeat_profile.h); each window is predicted only where that costs less, so the stream is
//                             never larger than with every clip unique
//
// Settings say how coarse a stream without a target is; with a target the search for it decides.
// What it does not do: levels of detail; parts of a clip are cut from the whole clip.
#pragma once

#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

class RmaCodec final : public Codec {
 public:
  [[nodiscard]] std::string_view name() const override { return "rma"; }
  [[nodiscard]] std::span<const CodecSetting> settings() const override;
  [[nodiscard]] Bytes encode(std::span<const Clip> clips, const CodecOptions& options) const override;
  [[nodiscard]] std::unique_ptr<StreamReader> open(Bitstream stream) const override;
};

// By clip: the frames at which coded pieces of it meet (clips of the analysis, windows), but for jumps of the motion
// itself. Throws Error{bad_input} naming `source`.
[[nodiscard]] std::vector<std::vector<int>> rma_seams(std::span<const std::byte> stream, std::string source);

}  // namespace kinespace
