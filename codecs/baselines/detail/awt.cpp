// The `awt` codec: wavelet compression adapted to motion (beaudoin, poulin, van de panne 2007; khan2014, section 5).
//
// Each channel keeps its largest coefficients of the cubic interpolating wavelet; how many is a budget of the channel.
// All start with the same, then simulated annealing moves budget between channels to lower the distortion of joint
// positions, which is here
//
//   sum over c, d of G(c, d) <e_c, e_d>
//
// with e_c what channel c has lost and G how the channels move the joints together, on the average over the clip's
// poses (channel_metric.h): to second order the squared distance of joint positions. The wavelet is near orthonormal,
// so <e_c, e_d> is a sum over coefficients and a move costs little. Seeded: the same clip always gives the same stream.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "kinespace/codecs/baselines/detail/channel_transform.h"
#include "kinespace/codecs/baselines/detail/wavelet_coefficients.h"

namespace kinespace {
namespace {

constexpr std::array awt_settings{
    CodecSetting{"coefficients", 40, 1, 1e6, "kept of each channel of a clip, on the average"},
    CodecSetting{"step", 0, 0, 1e3, "quantiser step in degrees (cm) times root samples; 0: what goes with the error"},
    CodecSetting{"rate_weight", 0, 0, 1, "squared steps that a bit is worth when values are chosen"},
};
constexpr double noise_share = 1;        // of what was left out
constexpr double paper_rounding = 0.01;  // two decimals

// xorshift64* (vigna 2016).
class Random {
 public:
  std::uint64_t next() {
    state_ ^= state_ >> 12;
    state_ ^= state_ << 25;
    state_ ^= state_ >> 27;
    return state_ * 0x2545f4914f6cdd1dULL;
  }
  std::size_t below(std::size_t bound) { return static_cast<std::size_t>((next() >> 11) % bound); }
  double uniform() { return static_cast<double>(next() >> 11) / 9007199254740992.0; }

 private:
  std::uint64_t state_ = 0x9e3779b97f4a7c15ULL;
};

// Which coefficients are kept, and the distortion of that.
class Budget {
 public:
  Budget(const WaveletCoefficients& coefficients, const std::vector<std::vector<int>>& order,
         const Eigen::MatrixXd& metric, std::size_t total)
      : functions_(static_cast<std::size_t>(coefficients.shape.functions)),
        wanted_(coefficients.values),
        order_(order),
        metric_(metric),
        lost_(wanted_.size()),
        kept_(order.size(), 0) {
    const std::size_t channels = order.size();
    for (std::size_t i = 0; i < wanted_.size(); ++i) lost_[(i % functions_) * channels + i / functions_] = wanted_[i];
    for (std::size_t c = 0; c < channels; ++c) {
      const std::size_t share = std::clamp<std::size_t>((total + channels - 1 - c) / channels, 1, functions_);
      change(c, static_cast<std::ptrdiff_t>(share));
    }
  }

  [[nodiscard]] std::size_t kept(std::size_t channel) const { return kept_[channel]; }
  [[nodiscard]] bool can(std::size_t channel, std::ptrdiff_t more) const {
    const auto after = static_cast<std::ptrdiff_t>(kept_[channel]) + more;
    return after >= 1 && after <= static_cast<std::ptrdiff_t>(functions_);
  }
  // Keeps so many more (or fewer) of a channel; how the distortion changes.
  double change(std::size_t channel, std::ptrdiff_t more) {
    double out = 0;
    for (; more > 0; --more) out += set(channel, order_[channel][kept_[channel]++], true);
    for (; more < 0; ++more) out += set(channel, order_[channel][--kept_[channel]], false);
    return out;
  }
  [[nodiscard]] double distortion() const {
    const Eigen::Map<const Eigen::MatrixXd> lost(lost_.data(), static_cast<Eigen::Index>(kept_.size()),
                                                 static_cast<Eigen::Index>(functions_));
    return (metric_.cwiseProduct(lost * lost.transpose())).sum();
  }
  [[nodiscard]] double squared_loss() const {
    double out = 0;
    for (const double e : lost_) out += e * e;
    return out;
  }
  [[nodiscard]] std::vector<double> values(double step) const {
    std::vector<double> out(wanted_.size());
    for (std::size_t c = 0; c < kept_.size(); ++c) {
      for (std::size_t i = 0; i < kept_[c]; ++i) {
        const std::size_t place = c * functions_ + static_cast<std::size_t>(order_[c][i]);
        out[place] = wanted_[place] / step;
      }
    }
    return out;
  }

 private:
  double set(std::size_t channel, int coefficient, bool keep) {
    const auto k = static_cast<std::size_t>(coefficient);
    double* lost = lost_.data() + k * kept_.size();
    double& own = lost[channel];
    const double after = keep ? 0 : wanted_[channel * functions_ + k];
    const double difference = after - own;
    if (difference == 0) return 0;
    const auto c = static_cast<Eigen::Index>(channel);
    const auto count = static_cast<Eigen::Index>(kept_.size());
    const double moved = metric_.col(c).dot(Eigen::Map<const Eigen::VectorXd>(lost, count));
    const double out = difference * (2 * moved + metric_(c, c) * difference);
    own = after;
    return out;
  }

  std::size_t functions_;
  const std::vector<double>& wanted_;
  const std::vector<std::vector<int>>& order_;
  const Eigen::MatrixXd& metric_;
  std::vector<double> lost_;  // [coefficient][channel]
  std::vector<std::size_t> kept_;
};

void anneal(Budget& budget, std::size_t channels) {
  constexpr std::size_t moves_each = 300;
  constexpr double coldest = 1e-5;
  if (channels < 2) return;
  Random random;
  double distortion = budget.distortion();
  double temperature = 0.02 * distortion / static_cast<double>(channels);
  const std::size_t moves = moves_each * channels;
  const double cooling = std::pow(coldest, 1 / static_cast<double>(moves));
  for (std::size_t m = 0; m < moves; ++m, temperature *= cooling) {
    const std::size_t to = random.below(channels);
    const std::size_t from = (to + 1 + random.below(channels - 1)) % channels;
    // Large moves first, single coefficients at the end.
    const auto most = 1 + std::min(budget.kept(from), budget.kept(to)) * (moves - m) / (4 * moves);
    const auto amount = static_cast<std::ptrdiff_t>(1 + random.below(most));
    if (!budget.can(from, -amount) || !budget.can(to, amount)) continue;
    const double change = budget.change(from, -amount) + budget.change(to, amount);
    if (change <= 0 || random.uniform() < std::exp(-change / temperature)) {
      distortion += change;
    } else {
      budget.change(to, -amount);
      budget.change(from, amount);
    }
  }
}

class AwtAnalysis final : public PieceAnalysis {
 public:
  explicit AwtAnalysis(const ChannelPiece& piece) : piece_(piece), coefficients_(Wavelet::cubic_interpolating, piece) {
    const auto n = static_cast<std::size_t>(piece.frames);
    for (int c = 0; c < piece.channels; ++c) {
      const double* v = coefficients_.values.data() + static_cast<std::size_t>(c) * n;
      std::vector<int> largest_first(n);
      std::iota(largest_first.begin(), largest_first.end(), 0);
      std::ranges::stable_sort(largest_first, [&](int a, int b) { return std::abs(v[a]) > std::abs(v[b]); });
      order_.push_back(std::move(largest_first));
    }
  }

  [[nodiscard]] PieceCoefficients at(const Quality& quality) override {
    const auto channels = static_cast<std::size_t>(piece_.channels);
    Budget budget(coefficients_, order_, piece_.metric, total(quality));
    anneal(budget, channels);
    double kept = 0;
    for (std::size_t c = 0; c < channels; ++c) kept += static_cast<double>(budget.kept(c));
    const double least = quality.tolerance > 0 ? 0.05 * quality.tolerance : paper_rounding;
    const double step =
        quality.step > 0 ? quality.step : step_for_error(budget.squared_loss(), noise_share, kept, least);
    PieceCoefficients out{.shape = coefficients_.shape, .step_index = step_index_below(step)};
    out.values = budget.values(grid_step(out.step_index));
    return out;
  }

 private:
  // A tolerance asks for as many coefficients as are larger.
  [[nodiscard]] std::size_t total(const Quality& quality) const {
    if (!(quality.tolerance > 0)) return static_cast<std::size_t>(std::llround(quality.amount * piece_.channels));
    const auto larger =
        std::ranges::count_if(coefficients_.values, [&](double v) { return std::abs(v) > quality.tolerance; });
    return static_cast<std::size_t>(larger);
  }

  const ChannelPiece& piece_;
  WaveletCoefficients coefficients_;
  std::vector<std::vector<int>> order_;  // by channel: the largest first
};

class AwtTransform final : public ChannelTransform {
 public:
  [[nodiscard]] std::string_view name() const override { return "awt"; }
  [[nodiscard]] std::span<const CodecSetting> settings() const override { return awt_settings; }
  [[nodiscard]] std::unique_ptr<PieceAnalysis> analyse(const ChannelPiece& piece) const override {
    return std::make_unique<AwtAnalysis>(piece);
  }
  [[nodiscard]] PieceShape shape(int channels, int frames, double /*rate_hz*/, std::span<const std::byte> side,
                                 const std::string& source) const override {
    ByteReader(side, source).expect_end();
    return wavelet_shape(Wavelet::cubic_interpolating, channels, frames);
  }
  void synthesise(const PieceShape& shape, std::span<const std::byte> /*side*/, std::span<const double> coefficients,
                  int frames, double /*step*/, std::span<double> values, const std::string& /*source*/) const override {
    wavelet_synthesis(Wavelet::cubic_interpolating, shape, coefficients, frames, values);
  }
};

}  // namespace

const ChannelTransform& awt_transform() {
  static const AwtTransform transform;
  return transform;
}

}  // namespace kinespace
