// The clip-pca codec (arikan 2006), as lin2011, section 6, compares its own method with it: clips of one length (200
// ms, or 533 ms below 60 Hz), a cubic Bezier curve for each coordinate of three virtual markers per joint, clustered
// clips, principal components of a cluster's clips, coefficients of 16 bits; root alignment, contacts, seams and the
// lossless stage are those of the RMA codec (codecs/rma).
//
// There for comparison: its axes are long (four control points by nine coordinates by joints) and weigh on all but
// large collections.
#pragma once

#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

class ClipPcaCodec final : public Codec {
 public:
  [[nodiscard]] std::string_view name() const override { return "clip-pca"; }
  [[nodiscard]] std::span<const CodecSetting> settings() const override;
  [[nodiscard]] Bytes encode(std::span<const Clip> clips, const CodecOptions& options) const override;
  [[nodiscard]] std::unique_ptr<StreamReader> open(Bitstream stream) const override;
};

}  // namespace kinespace
