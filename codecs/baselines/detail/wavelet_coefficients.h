// Wavelet coefficients of all channels of a piece, as blocks of the coefficient coder: a component is a channel, a band
// a level, from the coarse curve to the finest details. Private to this folder.
#pragma once

#include "kinespace/codecs/baselines/detail/channel_transform.h"
#include "kinespace/codecs/baselines/detail/wavelets.h"

namespace kinespace {

[[nodiscard]] PieceShape wavelet_shape(Wavelet wavelet, int channels, int frames);

struct WaveletCoefficients {
  WaveletCoefficients(Wavelet wavelet, const ChannelPiece& piece);
  PieceShape shape;
  std::vector<double> values;  // [channel][coefficient]
};

void wavelet_synthesis(Wavelet wavelet, const PieceShape& shape, std::span<const double> coefficients, int frames,
                       std::span<double> values);

}  // namespace kinespace
