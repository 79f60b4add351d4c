#include "kinespace/codecs/baselines/detail/wavelet_coefficients.h"

#include <algorithm>

namespace kinespace {

PieceShape wavelet_shape(Wavelet wavelet, int channels, int frames) {
  static_assert(WaveletTransform::most_levels + 1 <= band_count);
  PieceShape out{.components = channels, .functions = frames};
  out.edges.fill(frames);
  const std::vector<int> edges = WaveletTransform(wavelet, frames).edges();
  std::ranges::copy(edges, out.edges.begin());
  return out;
}

WaveletCoefficients::WaveletCoefficients(Wavelet wavelet, const ChannelPiece& piece)
    : shape(wavelet_shape(wavelet, piece.channels, piece.frames)), values(piece.values.size()) {
  const WaveletTransform transform(wavelet, piece.frames);
  const auto n = static_cast<std::size_t>(piece.frames);
  for (std::size_t from = 0; from < values.size(); from += n) {
    transform.forward(std::span(piece.values).subspan(from, n), std::span(values).subspan(from, n));
  }
}

void wavelet_synthesis(Wavelet wavelet, const PieceShape& shape, std::span<const double> coefficients, int frames,
                       std::span<double> values) {
  const WaveletTransform transform(wavelet, frames);
  const auto n = static_cast<std::size_t>(frames), used = static_cast<std::size_t>(shape.functions);
  std::vector<double> all(n, 0.0);
  for (std::size_t c = 0; c < static_cast<std::size_t>(shape.components); ++c) {
    std::ranges::copy(coefficients.subspan(c * used, used), all.begin());
    transform.inverse(all, values.subspan(c * n, n));
  }
}

}  // namespace kinespace
