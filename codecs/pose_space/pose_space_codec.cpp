#include "kinespace/codecs/pose_space/pose_space_codec.h"

#include <array>

#include "kinespace/codecs/pose_space/detail/pose_space_search.h"

namespace kinespace {
namespace {

constexpr std::array codec_settings{
    CodecSetting{"step", 2.5, 1e-6, 1e6, "quantiser step where no target is given, in cm times the root of the joints"},
    CodecSetting{"shell_ratio", 1.6, 1.05, 100, "largest shell error, as a multiple of the mean joint error"},
    CodecSetting{"rate_weight", 0.18, 0, 1, "squared steps that a bit is worth when values are chosen"},
    CodecSetting{"window_s", 0, 0, 60, "length of the windows in seconds; 0: cut where it saves bits"},
    CodecSetting{"group_frames", 4096, 1, 1 << 20, "frames that are decoded together at least"},
};

}  // namespace

std::span<const CodecSetting> PoseSpaceCodec::settings() const {
  return codec_settings;
}

Bytes PoseSpaceCodec::encode(std::span<const Clip> clips, const CodecOptions& options) const {
  const PoseSpaceSettings settings{.rate_weight = setting(options, "rate_weight"),
                                   .window_s = setting(options, "window_s"),
                                   .group_frames = static_cast<int>(setting(options, "group_frames"))};
  PoseSpaceSearch search(clips, options.progress, settings, setting(options, "shell_ratio"), options.basis);
  const CodecTarget& target = options.target;
  if (target.mean_error_cm) return search.for_mean_error(*target.mean_error_cm);
  if (target.max_error_cm) return search.for_max_error(*target.max_error_cm);
  if (target.bytes) return search.for_bytes(*target.bytes);
  return search.at_step(setting(options, "step"));
}

}  // namespace kinespace
