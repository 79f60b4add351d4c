// The `qbc` codec: quadratic Bezier break-and-fit (M. A. Khan, Multimed Tools Appl 2014), each joint by itself.
//
// A joint's channels (codecs/stream/joint_channels.h: the turns that it makes, in degrees; the travel root's position in units
// of `root_unit` beside its turns) are a curve in R^N of connected quadratic Bezier segments. No frame of a joint is
// farther from it than the limit d^2, a hard maximum of the squared distance of the *decoded* curve in the channels'
// own units; joints that never turn are exact to 0.01 degrees.
//
// What is sent of a curve, and how, is in codecs/qbc/detail/curve_code.h. Beyond the paper, whose control points are decimals:
//
//   - control points need not lie on the data: they are fitted together by least squares;
//   - breaks are chosen by error and bits together (the setting `merge`; 0: the paper's rule alone);
//   - points are quantised as finely as the frames they count for ask, and coded against what is expected of them.
//
// Every joint's bytes stand alone (decode_joint), and begin with the curve at the common breaks every `interval`
// frames, which can be shown without decoding the rest (decode_preview; the paper's I frames).
//
// Frames of the root where the file's own angles come near their poles, so that a small turn moves them far, are sent
// more finely where that pays: eight of 2751 can hold half of a clip's error (codecs/qbc/detail/pole_corrections.h).
//
// Targets set the limit. The mean squared error (equation 11) is about a ninetieth of d^2 (more by the paper's rule);
// encoding takes about a fifth of a millisecond a frame, without `merge` a tenth of that.
#pragma once

#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

class QbcCodec final : public Codec {
 public:
  [[nodiscard]] std::string_view name() const override { return "qbc"; }
  [[nodiscard]] std::span<const CodecSetting> settings() const override;
  [[nodiscard]] Bytes encode(std::span<const Clip> clips, const CodecOptions& options) const override;
  [[nodiscard]] std::unique_ptr<StreamReader> open(Bitstream stream) const override;
};

}  // namespace kinespace
