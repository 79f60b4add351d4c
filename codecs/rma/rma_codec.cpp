#include "kinespace/codecs/rma/rma_codec.h"

#include <array>

#include "kinespace/base/error.h"
#include "kinespace/codecs/rma/detail/paper_profile.h"
#include "kinespace/codecs/rma/detail/repeat_profile.h"
#include "kinespace/codecs/rma/detail/repeat_stream.h"
#include "kinespace/codecs/rma/marker_stream.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/measured_stream.h"

namespace kinespace {
namespace {

constexpr std::array rma_settings{
    CodecSetting::choice("profile", "default", "paper", "the paper's rules, or what goes beyond them"),
    CodecSetting{"variance", 95, 30, 100, "paper's profile without a target: percent of variance that the axes keep"},
    CodecSetting{"step", 15, 1e-6, 1e6,
                 "default profile without a target: quantiser step, in cm times the root of the joints"},
    CodecSetting::flag("repeats", true, "repeated clips refer to primary ones; off: every clip is unique"),
    CodecSetting::flag("contacts", true, "joints on the ground are kept apart and put there by inverse kinematics"),
    CodecSetting::whole("primary_bits", 0, 0, 24,
                        "paper's profile: bits of primary clips' control points; 0: adaptive"),
    CodecSetting::whole("repeated_bits", 0, 0, 24,
                        "paper's profile: bits of repeated clips' control points; 0: adaptive"),
};

}  // namespace

std::span<const CodecSetting> RmaCodec::settings() const {
  return rma_settings;
}

Bytes RmaCodec::encode(std::span<const Clip> clips, const CodecOptions& options) const {
  const bool repeats = flag(options, "repeats");
  const bool contacts = flag(options, "contacts");
  if (!flag(options, "profile")) {
    return encode_repeat_profile(clips, options.target,
                                 {.step = setting(options, "step"), .repeats = repeats, .contacts = contacts},
                                 options.progress);
  }
  return encode_paper_profile(clips, options.target,
                              {.variance = setting(options, "variance"),
                               .repeats = repeats,
                               .contacts = contacts,
                               .primary_bits = static_cast<int>(setting(options, "primary_bits")),
                               .repeated_bits = static_cast<int>(setting(options, "repeated_bits"))},
                              options.progress);
}

std::vector<std::vector<int>> rma_seams(std::span<const std::byte> bytes, std::string source) {
  const Bitstream stream = Bitstream::parse(bytes, std::move(source));
  stream.require_kind(stream_kind("rma"));
  static_cast<void>(payload_version(stream, RmaCodec().versions()));
  const ClipTable table = unpack_clip_table(stream.section("clips"), most_frames(stream.size()), stream.source());
  const std::int64_t numbers = most_numbers(stream.size());
  std::vector<std::vector<int>> out(table.clips.size());
  const auto add = [&](std::size_t clip, int first) {
    if (first > 0 && first < table.clips[clip].frames) out[clip].push_back(first);
  };
  if (stream.option("profile") == "paper") {
    const MarkerStream motion =
        unpack_marker_stream(stream.section("motion"), table, marker_dimensions(table), numbers, stream.source());
    std::size_t piece = 0;
    for (std::size_t c = 0; c < out.size(); ++c) {
      for (int f = 0; f < table.clips[c].frames && piece < motion.clips.size(); f += motion.clips[piece++].frames) {
        add(c, f);
      }
    }
    return out;
  }
  RepeatTables tables;
  const int joints = static_cast<int>(table.skeletons.front().rotating_joints().size());
  tables.tables = unpack_pose_space_tables(stream.section("tables"), joints, stream.source());
  unpack_repeats(stream.section("repeats"), table, numbers, stream.source(), tables);
  std::size_t window = 0;
  for (std::size_t c = 0; c < out.size(); ++c) {
    int first = 0;
    for (const int points : table.clips[c].blocks) {
      if (!tables.jumps[window++]) add(c, first);
      first += points;
    }
  }
  return out;
}

std::unique_ptr<StreamReader> RmaCodec::open(Bitstream stream) const {
  stream.require_kind(stream_kind(name()));
  const std::string& profile = stream.option("profile");
  if (profile == "paper") return open_paper_profile(std::move(stream));
  if (profile == "default") return open_repeat_profile(std::move(stream));
  throw Error(ErrorKind::bad_input,
              {.file = stream.source(), .found = "profile " + profile, .expected = "paper or default"});
}

}  // namespace kinespace
