#include "kinespace/codecs/baselines/raw_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/baselines/detail/packers.h"
#include "kinespace/codecs/stream/clip_reader.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/joint_channels.h"
#include "kinespace/codecs/stream/measured_stream.h"

namespace kinespace {
namespace {

constexpr std::array zstd_settings{CodecSetting::whole("level", 19, 1, highest_zstd_level, "zstandard's level")};
constexpr std::array xz_settings{CodecSetting::whole("level", 6, 0, highest_xz_level, "xz's preset")};
constexpr std::size_t planes = sizeof(float);

// Three turns for every joint, in its parent's frame.
ChannelLayout plain_layout(const Skeleton& skeleton) {
  ChannelLayout out;
  int channel = 3;
  for (const int joint : skeleton.rotating_joints()) {
    JointFreedom freedom{.joint = joint, .turns = 3};
    freedom.first_channel = channel;
    channel += 3;
    out.joints.push_back(freedom);
  }
  return out;
}

// A float's bits as a number that grows with the float, and back.
std::uint32_t ordered(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  return (bits & 0x80000000U) != 0 ? ~bits : bits | 0x80000000U;
}
float unordered(std::uint32_t number) {
  return std::bit_cast<float>((number & 0x80000000U) != 0 ? number & 0x7fffffffU : ~number);
}
// Small differences of either sign as small numbers.
std::uint32_t folded(std::uint32_t difference) {
  return (difference << 1) ^ ((difference & 0x80000000U) != 0 ? 0xffffffffU : 0U);
}
std::uint32_t unfolded(std::uint32_t number) {
  return (number >> 1) ^ ((number & 1U) != 0 ? 0xffffffffU : 0U);
}

// [plane][channel][frame].
Bytes to_planes(const ChannelCurves& curves) {
  const std::size_t count = curves.values.size();
  Bytes out(planes * count);
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t now = ordered(static_cast<float>(curves.values[i]));
    const std::uint32_t number = folded(now - last);
    last = now;
    for (std::size_t p = 0; p < planes; ++p) out[p * count + i] = static_cast<std::byte>(number >> (24 - 8 * p));
  }
  return out;
}

void from_planes(std::span<const std::byte> bytes, std::span<double> values, const std::string& source) {
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::uint32_t number = 0;
    for (std::size_t p = 0; p < planes; ++p) {
      number = (number << 8) | static_cast<std::uint32_t>(bytes[p * values.size() + i]);
    }
    last += unfolded(number);
    values[i] = unordered(last);
    if (!(std::abs(values[i]) < 2 * largest_channel_value)) {
      throw Error(ErrorKind::bad_input, {.file = source,
                                         .found = "channels that are no numbers or huge",
                                         .expected = "what the encoder writes (damaged)"});
    }
  }
}

class RawReader final : public ClipReader {
 public:
  RawReader(Packer packer, Bitstream bits)
      : ClipReader(std::move(bits)),
        packer_(packer),
        layout_(plain_layout(table().skeletons.front())),
        packed_(unpack_parts(stream().section("channels"), clips().size(), "bytes of a clip", stream().source())) {}

 private:
  [[nodiscard]] Clip part(std::size_t clip, int first, int count, int /*level*/) const override {
    const int frames = entry(clip).frames;
    Clip out = at_rest(clip, 0, frames);
    std::vector<double> values(static_cast<std::size_t>(layout_.channel_count()) * static_cast<std::size_t>(frames));
    from_planes(unpack_bytes(packer_, packed_[clip], planes * values.size(), stream().source()), values,
                stream().source());
    write_channels(layout_, values, 0, frames, out);
    return cut(std::move(out), first, count);
  }

  Packer packer_;
  ChannelLayout layout_;
  std::vector<std::span<const std::byte>> packed_;  // by clip
};

void require_met(const CodecTarget& target, const MeasuredError& error, std::size_t size) {
  const bool met = (!target.mean_error_cm || error.mean_joint_error_cm <= *target.mean_error_cm) &&
                   (!target.max_error_cm || error.max_joint_error_cm <= *target.max_error_cm) &&
                   (!target.bytes || static_cast<std::int64_t>(size) <= *target.bytes);
  if (met) return;
  throw Error(
      ErrorKind::usage,
      {.found = fmt::format("a target that cannot be met: lossless, the clips take {} bytes and are off by {} cm", size,
                            error.max_joint_error_cm),
       .expected = "a codec that can be lossy, or another target"});
}

}  // namespace

std::string_view RawCodec::name() const {
  return packer_ == Packer::zstd ? "raw+zstd" : "raw+xz";
}

std::span<const CodecSetting> RawCodec::settings() const {
  if (packer_ == Packer::zstd) return zstd_settings;
  return xz_settings;
}

Bytes RawCodec::encode(std::span<const Clip> clips, const CodecOptions& options) const {
  const int level = static_cast<int>(setting(options, "level"));
  const ClipTable table = clip_table_of(clips);
  const ChannelLayout layout = plain_layout(clips.front().skeleton);
  std::vector<Bytes> packed(clips.size());
  parallel_for(std::size_t{0}, clips.size(), [&](std::size_t c) {
    options.progress.check_stop();
    const ChannelCurves curves = channel_curves(clips[c], layout);
    require_channels_below(largest_channel_value, curves, clips[c].name);
    packed[c] = pack_bytes(packer_, level, to_planes(curves));
  });
  const Bytes clip_bytes = pack_clip_table(table);
  const Bytes channels = pack_parts(packed);
  const auto write = [&](const MeasuredError& error) {
    BitstreamWriter out(stream_kind(name()));
    out.set_error(error);
    out.add_section("clips", clip_bytes);
    out.add_section("channels", channels);
    add_padding(out, clip_bytes.size() + channels.size(), table.frames());
    return out.finish();
  };
  CodedAttempt made = write_measured(clips, write, [&](Bitstream stream) { return open(std::move(stream)); });
  require_met(options.target, made.error, made.stream.size());
  return std::move(made.stream);
}

std::unique_ptr<StreamReader> RawCodec::open(Bitstream stream) const {
  stream.require_kind(stream_kind(name()));
  return std::make_unique<RawReader>(packer_, std::move(stream));
}

}  // namespace kinespace
