#include "codecs/rma/rma_codec.h"

#include <array>

#include "base/error.h"
#include "codecs/registry.h"
#include "codecs/rma/paper_profile.h"
#include "codecs/rma/repeat_profile.h"

namespace kinespace {
namespace {

constexpr std::array codec_settings{
    CodecSetting{"profile", 0, 0, 1, "0: default; 1: the paper's rules"},
    CodecSetting{"variance", 95, 30, 100, "paper's profile without a target: percent of variance that the axes keep"},
    CodecSetting{"step", 15, 1e-6, 1e6,
                 "default profile without a target: quantiser step, in cm times the root of the joints"},
    CodecSetting{"repeats", 1, 0, 1, "0: every clip is unique; 1: repeated clips refer to primary ones"},
    CodecSetting{"contacts", 1, 0, 1, "1: joints on the ground are kept apart and put there by inverse kinematics"},
    CodecSetting{"primary_bits", 0, 0, 24, "paper's profile: bits of primary clips' control points; 0: adaptive"},
    CodecSetting{"repeated_bits", 0, 0, 24, "paper's profile: bits of repeated clips' control points; 0: adaptive"},
};

}  // namespace

std::span<const CodecSetting> RmaCodec::settings() const {
  return codec_settings;
}

Bytes RmaCodec::encode(std::span<const Clip> clips, const CodecOptions& options) const {
  const bool repeats = setting(options, "repeats") >= 0.5;
  const bool contacts = setting(options, "contacts") >= 0.5;
  if (setting(options, "profile") < 0.5) {
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

std::unique_ptr<StreamReader> RmaCodec::open(Bitstream stream) const {
  stream.require_kind(stream_kind(name()));
  const std::string& profile = stream.option("profile");
  if (profile == "paper") return open_paper_profile(std::move(stream));
  if (profile == "default") return open_repeat_profile(std::move(stream));
  throw Error(ErrorKind::bad_input,
              {.file = stream.source(), .found = "profile " + profile, .expected = "paper or default"});
}

}  // namespace kinespace
