// A codec as small as one can be: what it takes to add one. Channels of all joints, rounded to a step, as differences
// from frame to frame. It passes the tests that every codec of the registry must pass.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/codecs/stream/clip_reader.h"
#include "kinespace/codecs/stream/joint_channels.h"
#include "kinespace/codecs/stream/target_search.h"
#include "kinespace/entropy/integer_coder.h"

namespace kinespace::test {

class ToyReader final : public ClipReader {
 public:
  explicit ToyReader(Bitstream bits)
      : ClipReader(std::move(bits)),
        step_(stream().number_option("step", 1e-9, 1e6)),
        layout_(unpack_layout(stream().section("layout"), table().skeletons.front(), stream().source())),
        numbers_(unpack_parts(stream().section("numbers"), clips().size(), "bytes of a clip", stream().source())) {}

 private:
  [[nodiscard]] Clip part(std::size_t clip, int first, int count, int /*level*/) const override {
    const int frames = entry(clip).frames;
    Clip out = at_rest(clip, 0, frames);
    std::vector<double> values(static_cast<std::size_t>(layout_.channel_count()) * static_cast<std::size_t>(frames));
    IntegerReader in(numbers_[clip], stream().source());
    const auto most = static_cast<std::int64_t>(2 * largest_channel_value / step_);
    for (std::int64_t number = 0; double& value : values) {
      number += in.get();
      if (std::abs(number) > most) in.damaged();
      value = static_cast<double>(number) * step_;
    }
    in.expect_end();
    write_channels(layout_, values, 0, frames, out);
    return cut(std::move(out), first, count);
  }

  double step_;
  ChannelLayout layout_;
  std::vector<std::span<const std::byte>> numbers_;  // by clip
};

class ToyCodec final : public Codec {
 public:
  [[nodiscard]] std::string_view name() const override { return "toy"; }
  [[nodiscard]] std::span<const CodecSetting> settings() const override { return toy_settings; }

  [[nodiscard]] Bytes encode(std::span<const Clip> clips, const CodecOptions& options) const override {
    const ChannelLayout layout = find_channel_layout(clips, {});
    std::vector<ChannelCurves> curves;
    for (const Clip& clip : clips) {
      curves.push_back(channel_curves(clip, layout));
      require_channels_below(largest_channel_value, curves.back(), clip.name);
    }
    const ClipTable table = clip_table_of(clips);
    const auto attempt = [&](double step) {
      std::vector<Bytes> numbers;
      for (const ChannelCurves& one : curves) numbers.push_back(coded(one, step));
      return write_measured(
          clips, [&](const MeasuredError& error) { return written(table, layout, numbers, step, error); },
          [this](Bitstream stream) { return open(std::move(stream)); });
    };
    if (!options.target.any()) return attempt(setting(options, "step")).stream;
    return search_target(options.target, {.start = 0.1, .least = 1e-6, .most = 1e3}, attempt);
  }

  [[nodiscard]] std::unique_ptr<StreamReader> open(Bitstream stream) const override {
    stream.require_kind(stream_kind(name()));
    return std::make_unique<ToyReader>(std::move(stream));
  }

 private:
  static constexpr std::array toy_settings{CodecSetting{"step", 0.1, 1e-6, 1e3, "of all channels, in degrees (cm)"}};

  static Bytes coded(const ChannelCurves& curves, double step) {
    IntegerWriter out;
    for (std::int64_t before = 0; const double value : curves.values) {
      const std::int64_t now = std::llround(value / step);
      out.put(now - before);
      before = now;
    }
    return std::move(out).finish();
  }

  Bytes written(const ClipTable& table, const ChannelLayout& layout, const std::vector<Bytes>& numbers, double step,
                const MeasuredError& error) const {
    BitstreamWriter out(stream_kind(name()));
    out.set_error(error);
    out.set_option("step", step);
    out.add_section("clips", pack_clip_table(table));
    out.add_section("layout", pack_layout(layout));
    Bytes packed = pack_parts(numbers);
    const std::size_t size = packed.size();
    out.add_section("numbers", std::move(packed));
    add_padding(out, size, table.frames());
    return out.finish();
  }
};

}  // namespace kinespace::test
