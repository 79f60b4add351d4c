// The `fourier` codec: each curve of a clip as a Fourier series over the whole clip, of as few functions as its
// tolerance allows (yoo2019, section 7.2; METHODS: analytic bases).
#include "kinespace/codecs/baselines/detail/analytic_bases.h"
#include "kinespace/codecs/baselines/detail/analytic_transform.h"

namespace kinespace {
namespace {

class FourierTransform final : public AnalyticTransform {
 public:
  [[nodiscard]] std::string_view name() const override { return "fourier"; }

 protected:
  void analyse_some(const ChannelPiece& piece, int /*first*/, int last, std::span<double> coefficients) const override {
    const DiscreteFourier series(piece.frames);
    const auto n = static_cast<std::size_t>(piece.frames), kept = static_cast<std::size_t>(last);
    std::vector<double> all(n);
    for (std::size_t c = 0; c < static_cast<std::size_t>(piece.channels); ++c) {
      series.analyse(std::span(piece.values).subspan(c * n, n), all);
      std::copy_n(all.begin(), kept, coefficients.begin() + static_cast<std::ptrdiff_t>(c * n));
    }
  }
  [[nodiscard]] int at_once(int frames) const override { return frames; }

 public:
  void synthesise(const PieceShape& shape, std::span<const std::byte> /*side*/, std::span<const double> coefficients,
                  int frames, double /*step*/, std::span<double> values, const std::string& /*source*/) const override {
    const DiscreteFourier series(frames);
    const auto n = static_cast<std::size_t>(frames), used = static_cast<std::size_t>(shape.functions);
    for (std::size_t c = 0; c < static_cast<std::size_t>(shape.components); ++c) {
      series.synthesise(coefficients.subspan(c * used, used), values.subspan(c * n, n));
    }
  }
};

}  // namespace

const ChannelTransform& fourier_transform() {
  static const FourierTransform transform;
  return transform;
}

}  // namespace kinespace
