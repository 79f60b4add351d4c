// The `legendre` codec: each curve of a clip as a polynomial over the whole clip, of as low a degree as its tolerance
// allows (yoo2019, section 7.2; METHODS: analytic bases).
#include "kinespace/codecs/baselines/detail/analytic_bases.h"
#include "kinespace/codecs/baselines/detail/analytic_transform.h"

namespace kinespace {
namespace {

class LegendreTransform final : public AnalyticTransform {
 public:
  [[nodiscard]] std::string_view name() const override { return "legendre"; }
  void synthesise(const PieceShape& shape, std::span<const std::byte> /*side*/, std::span<const double> coefficients,
                  int frames, double /*step*/, std::span<double> values, const std::string& /*source*/) const override {
    DiscreteLegendre(frames).synthesise(coefficients, shape.components, shape.functions, shape.functions, values);
  }

 protected:
  void analyse_some(const ChannelPiece& piece, int first, int last, std::span<double> coefficients) const override {
    const DiscreteLegendre polynomials(piece.frames);
    polynomials.analyse(polynomials.fold(piece.values, piece.channels), piece.channels, first, last, coefficients,
                        piece.frames);
  }
  // A polynomial costs as much as a curve is long.
  [[nodiscard]] int at_once(int frames) const override { return 32 + frames / 16; }
};

}  // namespace

const ChannelTransform& legendre_transform() {
  static const LegendreTransform transform;
  return transform;
}

}  // namespace kinespace
