// The lossless floor: all channels of a clip as 32-bit floats, packed by a general compressor.
//
//   raw+zstd   zstandard (libzstd)
//   raw+xz     LZMA2 (liblzma)
//
// Channels are three positions of the travel root in cm and three turns of every rotating joint (Z, Y, X, in the frame
// of its parent, in unwrapped degrees): 96 for cmu, 66 for bandai, which is what ratios by "32-bit floats of all
// channels" count. Each clip is packed by itself. So that the compressors find something, every channel is kept as
// differences in time of the floats' bits (as whole numbers in the floats' order), and these byte plane by byte plane,
// the highest first; nothing is lost by that. What the rounding to floats leaves is about 1e-5 cm of joint position.
#pragma once

#include <cstdint>

#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

enum class Packer : std::uint8_t { zstd, xz };

class RawCodec final : public Codec {
 public:
  explicit RawCodec(Packer packer) : packer_(packer) {}
  [[nodiscard]] std::string_view name() const override;
  [[nodiscard]] std::span<const CodecSetting> settings() const override;
  // Targets are met when the clips happen to keep to them.
  [[nodiscard]] Bytes encode(std::span<const Clip> clips, const CodecOptions& options) const override;
  [[nodiscard]] std::unique_ptr<StreamReader> open(Bitstream stream) const override;

 private:
  Packer packer_;
};

}  // namespace kinespace
