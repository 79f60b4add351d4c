// The `dwt` codec (khan2014, section 5): each channel's wavelet transform; details that are no more than a threshold
// become zero.
//
// The paper does not name its wavelet: here the 9/7 pair (wavelets.h), which images and audio are compared with.
#include <cmath>

#include "kinespace/codecs/baselines/detail/channel_transform.h"
#include "kinespace/codecs/baselines/detail/wavelet_coefficients.h"

namespace kinespace {
namespace {

constexpr std::array dwt_settings{
    CodecSetting{"threshold", 4, 1e-6, 1e6, "details up to so much become zero, in degrees (cm) times root samples"},
    CodecSetting{"step", 0, 0, 1e3, "quantiser step, likewise; 0: in proportion to the threshold"},
    CodecSetting{"rate_weight", 0, 0, 1, "squared steps that a bit is worth when values are chosen"},
};
constexpr double step_of_threshold = 1.2;

class DwtAnalysis final : public PieceAnalysis {
 public:
  explicit DwtAnalysis(const ChannelPiece& piece) : coefficients_(Wavelet::cdf97, piece) {}

  [[nodiscard]] PieceCoefficients at(const Quality& quality) override {
    const double threshold = quality.tolerance > 0 ? quality.tolerance : quality.amount;
    PieceCoefficients out{.shape = coefficients_.shape};
    out.step_index = step_index_below(quality.step > 0 ? quality.step : step_of_threshold * threshold);
    const double step = grid_step(out.step_index);
    out.values = coefficients_.values;
    const int coarse = out.shape.edges[1];
    for (std::size_t i = 0; i < out.values.size(); ++i) {
      double& v = out.values[i];
      const bool detail = static_cast<int>(i % static_cast<std::size_t>(out.shape.functions)) >= coarse;
      v = detail && std::abs(v) <= threshold ? 0 : v / step;
    }
    return out;
  }

 private:
  WaveletCoefficients coefficients_;
};

class DwtTransform final : public ChannelTransform {
 public:
  [[nodiscard]] std::string_view name() const override { return "dwt"; }
  [[nodiscard]] std::span<const CodecSetting> settings() const override { return dwt_settings; }
  [[nodiscard]] std::unique_ptr<PieceAnalysis> analyse(const ChannelPiece& piece) const override {
    return std::make_unique<DwtAnalysis>(piece);
  }
  [[nodiscard]] PieceShape shape(int channels, int frames, double /*rate_hz*/, std::span<const std::byte> side,
                                 const std::string& source) const override {
    ByteReader(side, source).expect_end();
    return wavelet_shape(Wavelet::cdf97, channels, frames);
  }
  void synthesise(const PieceShape& shape, std::span<const std::byte> /*side*/, std::span<const double> coefficients,
                  int frames, double /*step*/, std::span<double> values, const std::string& /*source*/) const override {
    wavelet_synthesis(Wavelet::cdf97, shape, coefficients, frames, values);
  }
};

}  // namespace

const ChannelTransform& dwt_transform() {
  static const DwtTransform transform;
  return transform;
}

}  // namespace kinespace
