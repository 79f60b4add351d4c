// The search for the tolerance that meets a target.
#include "kinespace/codecs/baselines/channel_codec.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/baselines/detail/channel_encoder.h"

namespace kinespace {
namespace {

// Finds the coarsest tolerance that keeps an error, or the finest that keeps to a size.
class TargetSearch {
 public:
  TargetSearch(ChannelEncoder& encoder, const CodecTarget& target, double step, double rate_weight)
      : encoder_(encoder), target_(target), step_(step), rate_weight_(rate_weight) {}

  Bytes find() {
    double tolerance = first_guess();
    constexpr int most_rounds = 24;
    for (int round = 0; round < most_rounds; ++round) {
      const double ratio = attempt(tolerance);
      if (ratio <= 1 && ratio > close_enough) break;
      if (met_ && missed_ && std::abs(std::log(*met_ / *missed_)) < 0.004) break;
      tolerance = next(tolerance, ratio);
      if (tolerance < finest || tolerance > coarsest) break;
    }
    if (best_.empty()) cannot_meet(target_);
    return std::move(best_);
  }

 private:
  static constexpr double close_enough = 0.985;
  static constexpr double finest = 1e-7, coarsest = 1e6;

  [[nodiscard]] double first_guess() const {
    if (target_.mean_error_cm) return std::clamp(*target_.mean_error_cm, 10 * finest, coarsest / 10);
    if (target_.max_error_cm) return std::clamp(*target_.max_error_cm / 6, 10 * finest, coarsest / 10);
    return 1;
  }

  // What was reached over what was asked for: met when at most 1.
  double attempt(double tolerance) {
    ChannelEncoder::Result result = encoder_.encode({.tolerance = tolerance, .step = step_}, rate_weight_);
    const double ratio = target_.bytes ? static_cast<double>(result.stream.size()) / static_cast<double>(*target_.bytes)
                         : target_.mean_error_cm ? result.error.mean_joint_error_cm / *target_.mean_error_cm
                                                 : result.error.max_joint_error_cm / *target_.max_error_cm;
    std::optional<double>& side = ratio <= 1 ? met_ : missed_;
    double& side_ratio = ratio <= 1 ? met_ratio_ : missed_ratio_;
    const bool nearer = !side || (ratio <= 1) == (target_.bytes ? tolerance < *side : tolerance > *side);
    if (nearer) {
      side = tolerance;
      side_ratio = ratio;
    }
    if (ratio <= 1 && ratio > best_ratio_) {
      best_ratio_ = ratio;
      best_ = std::move(result.stream);
    }
    return ratio;
  }

  // Straight lines between logarithms, kept off the ends.
  [[nodiscard]] double next(double tolerance, double ratio) const {
    const double aim = std::log(0.993);
    if (met_ && missed_) {
      const double a = std::log(std::max(met_ratio_, 1e-6)), b = std::log(missed_ratio_);
      const double part = b > a ? std::clamp((aim - a) / (b - a), 0.08, 0.92) : 0.5;
      return std::exp(std::log(*met_) + part * (std::log(*missed_) - std::log(*met_)));
    }
    const double wanted = (aim - std::log(std::max(ratio, 1e-3))) * (target_.bytes ? -1.6 : 1.1);
    const double least = target_.bytes ? -0.02 : 0.02;  // onwards, whatever happens
    return tolerance * std::exp(std::clamp(wanted, -2.3, 2.3) + (ratio <= 1 ? least : -least));
  }

  ChannelEncoder& encoder_;
  const CodecTarget& target_;
  double step_, rate_weight_;
  std::optional<double> met_, missed_;  // tolerances, the nearest to the target on either side
  double met_ratio_ = 0, missed_ratio_ = 0, best_ratio_ = -1;
  Bytes best_;
};

// Small errors want joints held to their turns more closely.
ChannelSearch search_for(const CodecTarget& target) {
  ChannelSearch out;
  const double error = target.mean_error_cm  ? *target.mean_error_cm
                       : target.max_error_cm ? *target.max_error_cm / 4
                                             : 1;
  out.tolerance_degrees = std::clamp(0.05 * error, 1e-5, out.tolerance_degrees);
  return out;
}

}  // namespace

std::string_view ChannelCodec::name() const {
  return transform_.name();
}

std::span<const CodecSetting> ChannelCodec::settings() const {
  return transform_.settings();
}

Bytes ChannelCodec::encode(std::span<const Clip> clips, const CodecOptions& options) const {
  ChannelEncoder encoder(transform_, clips, search_for(options.target), options.progress);
  const double step = setting(options, "step");
  const double rate_weight = setting(options, "rate_weight");
  if (options.target.any()) return TargetSearch(encoder, options.target, step, rate_weight).find();
  return encoder.encode({.amount = setting(options, settings().front().name), .step = step}, rate_weight).stream;
}

}  // namespace kinespace
