// What a codec makes of one clip at one quality, measured every way that the papers measure. Part of `kinespace bench
// codecs`.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/motion/amc.h"

namespace kinespace {

// A file as the papers compress it: by itself.
struct SweepClip {
  Clip clip;
  std::optional<Asf> asf;  // of an AMC
  double text_bytes = 0;   // the motion file
};
// Throws Error.
[[nodiscard]] SweepClip read_sweep_clip(const std::filesystem::path& path);

struct CodecPoint {
  std::string codec;
  std::string setting;  // the quality that was asked for: NAME=VALUE
  double value = 0;
  double bytes = 0;
  double frames = 0;
  double mse = 0;         // khan2014, eq. 11: over the file's channels, in its units (degrees, and its unit of length)
  double text_ratio = 0;  // khan2014: the motion file's bytes over the stream's
  double raw_ratio = 0;   // lin2011, yoo2019: 32-bit floats of all channels over the stream's bytes
  double mean_joint_error_cm = 0;
  double max_joint_error_cm = 0;
  double shell_error_cm = 0;
  double mean_rotation_error_deg = 0;
  double kg = 0;
  double kg_time = 0;  // yoo2019, eq. 16
};

// Encodes, decodes and measures.
[[nodiscard]] CodecPoint measure_codec(const SweepClip& clip, const Codec& codec, const CodecOptions& options);
// The same for every value of the setting that the codec's quality is set by; none for a lossless codec: one point.
[[nodiscard]] std::vector<CodecPoint> sweep_codec(const SweepClip& clip, const Codec& codec);

// Equation 11: the mean squared difference over frames and channels. Of an AMC the channels are those of its lines:
// angles of C^-1 R C about the axes of the ASF, in degrees, and the root in units of the file; of other clips those of
// the skeleton. Angles that a decoded clip has where the file has no channel count as error too.
[[nodiscard]] double channel_mse(const SweepClip& original, const Clip& decoded);

// The text ratio of a sweep at a mean squared error, by linear interpolation of the logarithms; nothing outside.
[[nodiscard]] std::optional<double> ratio_at(std::span<const CodecPoint> points, double mse);

}  // namespace kinespace
