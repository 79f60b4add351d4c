// What the `fourier` and `legendre` codecs share: an orthonormal basis of functions, ordered from slow to fast, over
// the whole of a clip, and for each curve as few of the first functions as leave out no more than a tolerance, root
// mean square. Curves are weighted by how far they move the body, and quantiser and coder are those of the motion-space
// codec: what differs is the functions. Private to this folder.
#pragma once

#include "kinespace/codecs/baselines/detail/channel_transform.h"

namespace kinespace {

class AnalyticTransform : public ChannelTransform {
 public:
  [[nodiscard]] std::span<const CodecSetting> settings() const override;
  [[nodiscard]] bool weighted() const override { return true; }
  [[nodiscard]] std::unique_ptr<PieceAnalysis> analyse(const ChannelPiece& piece) const override;
  [[nodiscard]] PieceShape shape(int channels, int frames, double rate_hz, std::span<const std::byte> side,
                                 const std::string& source) const override;

 protected:
  friend class AnalyticAnalysis;
  // Coefficients [first, last) of all channels, to [channel][frames].
  virtual void analyse_some(const ChannelPiece& piece, int first, int last, std::span<double> coefficients) const = 0;
  // How many functions are worth to be found together.
  [[nodiscard]] virtual int at_once(int frames) const = 0;
};

}  // namespace kinespace
