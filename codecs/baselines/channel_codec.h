// The codecs that the papers compare with, which all code the channels of a clip (codecs/stream/joint_channels.h: the root's
// position in cm, the joints' turns in unwrapped degrees) as coefficients of a transform over the whole clip:
//
//   pca        the clip's own principal poses (khan2014, section 4)
//   dwt        wavelets with a threshold (khan2014, section 5)
//   awt        wavelets with a budget a channel, annealed (beaudoin 2007; khan2014)
//   fourier    Fourier series, as many functions a curve as it needs (yoo2019, section 7.2)
//   legendre   Legendre polynomials, likewise
//
// They are to be judged by their transforms, so all the rest is the same for all: a uniform quantiser with one step for
// a clip, the coefficient coder of the motion-space codec, the clip table, the stream. Setting `step` to 0.01 gives
// khan2014's rounding to two decimals; by default the step goes with the error, which takes fewer bytes. `rate_weight`
// is that of the motion-space codec (values chosen by error and bits); 0 rounds to the nearest.
//
// Targets set a tolerance that stands for the codec's own setting, found in a few rounds, each measured on the decoded
// clips. Clips are decoded one by one; a part of a clip takes as long as all of it (up to 16384 frames; longer clips
// are cut). Joints are held to the turns that they make, to 0.01 degrees (less for small errors asked for).
#pragma once

#include <memory>

#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

class ChannelTransform;

class ChannelCodec final : public Codec {
 public:
  explicit ChannelCodec(const ChannelTransform& transform) : transform_(transform) {}
  [[nodiscard]] std::string_view name() const override;
  [[nodiscard]] std::span<const CodecSetting> settings() const override;
  [[nodiscard]] Bytes encode(std::span<const Clip> clips, const CodecOptions& options) const override;
  [[nodiscard]] std::unique_ptr<StreamReader> open(Bitstream stream) const override;

 private:
  const ChannelTransform& transform_;
};

// ChannelCodec::open for the transform.
[[nodiscard]] std::unique_ptr<StreamReader> open_channel_stream(const ChannelTransform& transform, Bitstream stream);

}  // namespace kinespace
