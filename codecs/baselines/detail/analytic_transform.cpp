#include "kinespace/codecs/baselines/detail/analytic_transform.h"

#include <algorithm>
#include <cmath>

namespace kinespace {
namespace {

constexpr std::array analytic_settings{
    CodecSetting{"tolerance", 0.1, 1e-7, 1e3,
                 "of a curve, in cm of joint position, root mean square: as many functions"},
    CodecSetting{"step", 0, 0, 1e3, "quantiser step in cm times root samples; 0: in proportion to the tolerance"},
    CodecSetting{"rate_weight", 0.18, 0, 1, "squared steps that a bit is worth when values are chosen"},
};
constexpr double step_of_tolerance = 8;

PieceShape analytic_shape(int channels, int frames, double rate_hz) {
  return {.components = channels, .functions = frames, .edges = band_edges(frames, frames, rate_hz)};
}

}  // namespace

// Finds coefficients when they are first needed.
class AnalyticAnalysis final : public PieceAnalysis {
 public:
  AnalyticAnalysis(const AnalyticTransform& transform, const ChannelPiece& piece)
      : transform_(transform), piece_(piece), coefficients_(piece.values.size()), left_(piece.channels) {
    const auto n = static_cast<std::size_t>(piece.frames);
    for (std::size_t c = 0; c < left_.size(); ++c) {
      for (std::size_t t = 0; t < n; ++t) left_[c] += piece.values[c * n + t] * piece.values[c * n + t];
    }
    all_ = left_;
  }

  [[nodiscard]] PieceCoefficients at(const Quality& quality) override {
    const double tolerance = quality.tolerance > 0 ? quality.tolerance : quality.amount;
    const double allowed = tolerance * tolerance * piece_.frames;
    while (known_ < piece_.frames && std::ranges::any_of(left_, [&](double l) { return l > allowed; })) find_more();
    PieceCoefficients out{.shape = analytic_shape(piece_.channels, piece_.frames, piece_.rate_hz)};
    out.step_index = step_index_below(quality.step > 0 ? quality.step : step_of_tolerance * tolerance);
    const double step = grid_step(out.step_index);
    out.values.resize(coefficients_.size());
    const auto n = static_cast<std::size_t>(piece_.frames);
    for (std::size_t c = 0; c < all_.size(); ++c) {
      double left = all_[c];
      for (std::size_t k = 0; k < static_cast<std::size_t>(known_) && left > allowed; ++k) {
        const double v = coefficients_[c * n + k];
        left -= v * v;
        out.values[c * n + k] = v / step;
      }
    }
    return out;
  }

 private:
  void find_more() {
    const int last = std::min(piece_.frames, known_ + transform_.at_once(piece_.frames));
    transform_.analyse_some(piece_, known_, last, coefficients_);
    const auto n = static_cast<std::size_t>(piece_.frames);
    for (std::size_t c = 0; c < left_.size(); ++c) {
      for (auto k = static_cast<std::size_t>(known_); k < static_cast<std::size_t>(last); ++k) {
        left_[c] -= coefficients_[c * n + k] * coefficients_[c * n + k];
      }
    }
    known_ = last;
  }

  const AnalyticTransform& transform_;
  const ChannelPiece& piece_;
  std::vector<double> coefficients_;  // [channel][frames], the first known_ of each
  int known_ = 0;
  std::vector<double> all_, left_;  // by channel: sums of squares, and what the known functions leave of them
};

std::span<const CodecSetting> AnalyticTransform::settings() const {
  return analytic_settings;
}

std::unique_ptr<PieceAnalysis> AnalyticTransform::analyse(const ChannelPiece& piece) const {
  return std::make_unique<AnalyticAnalysis>(*this, piece);
}

PieceShape AnalyticTransform::shape(int channels, int frames, double rate_hz, std::span<const std::byte> side,
                                    const std::string& source) const {
  ByteReader(side, source).expect_end();
  return analytic_shape(channels, frames, rate_hz);
}

}  // namespace kinespace
