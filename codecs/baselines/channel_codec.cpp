// The search for the tolerance that meets a target.
#include "kinespace/codecs/baselines/channel_codec.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/baselines/detail/channel_encoder.h"
#include "kinespace/codecs/stream/target_search.h"

namespace kinespace {
namespace {

// Small errors want joints held to their turns more closely.
ChannelSearch search_for(const CodecTarget& target) {
  ChannelSearch out;
  const double error = target.mean_error_cm  ? *target.mean_error_cm
                       : target.max_error_cm ? *target.max_error_cm / 4
                                             : 1;
  out.tolerance_degrees = std::clamp(0.05 * error, 1e-5, out.tolerance_degrees);
  return out;
}

// About the error that may be expected, in cm.
SearchRange range_for(const CodecTarget& target) {
  SearchRange out{.start = 1, .least = 1e-7, .most = 1e6, .rounds = 12};
  if (target.mean_error_cm) out.start = *target.mean_error_cm;
  if (target.max_error_cm) out.start = *target.max_error_cm / 6;
  out.start = std::clamp(out.start, 10 * out.least, out.most / 10);
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
  if (options.target.any()) {
    return search_target(options.target, range_for(options.target), [&](double tolerance) {
      return encoder.encode({.tolerance = tolerance, .step = step}, rate_weight);
    });
  }
  return encoder.encode({.amount = setting(options, settings().front().name), .step = step}, rate_weight).stream;
}

}  // namespace kinespace
