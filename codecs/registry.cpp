#include "kinespace/codecs/registry.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/baselines/channel_codec.h"
#include "kinespace/codecs/baselines/detail/channel_transform.h"
#include "kinespace/codecs/baselines/raw_codec.h"
#include "kinespace/codecs/clip_pca/clip_pca_codec.h"
#include "kinespace/codecs/pose_space/pose_space_codec.h"
#include "kinespace/codecs/qbc/qbc_codec.h"
#include "kinespace/codecs/rma/rma_codec.h"

namespace kinespace {
namespace {

void check_settings(const Codec& codec, const CodecOptions& options) {
  for (const auto& [name, value] : options.settings) {
    const CodecSetting& setting = find_setting(codec, name);
    if (setting.allows(value)) continue;
    throw Error(ErrorKind::usage, {.found = fmt::format("{} = {}", name, value), .expected = setting.range()});
  }
}

// Before any codec computes with them: angles and rounded steps of what is no number have no meaning.
void require_numbers(const Clip& clip) {
  const auto refuse = [&](int joint, std::size_t frame) {
    const std::string& name = clip.skeleton.joints[static_cast<std::size_t>(joint)].name;
    throw Error(ErrorKind::bad_input, {.file = clip.name,
                                       .found = fmt::format("no number at joint {} in frame {}", name, frame + 1),
                                       .expected = "finite rotations and positions"});
  };
  const auto finite = [](double x) { return std::isfinite(x); };
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    const std::span<const double> track = clip.rotation_track(j);
    const auto bad = std::ranges::find_if_not(track, finite);
    if (bad != track.end()) refuse(j, static_cast<std::size_t>(bad - track.begin()) / 4);
  }
  for (const Clip::TranslationTrack& track : clip.translations) {
    const auto bad = std::ranges::find_if_not(track.values, [](const auto& at) { return at.allFinite(); });
    if (bad != track.values.end()) refuse(track.joint, static_cast<std::size_t>(bad - track.values.begin()));
  }
}

void check_clips(std::span<const Clip> clips) {
  if (clips.empty()) throw Error(ErrorKind::usage, {.found = "no clips", .expected = "at least one"});
  for (const Clip& clip : clips) {
    if (clip.frames >= 1 && clip.rate_hz > 0 && std::isfinite(clip.rate_hz)) {
      require_numbers(clip);
      continue;
    }
    throw Error(ErrorKind::bad_input, {.file = clip.name,
                                       .found = fmt::format("{} frames at {} Hz", clip.frames, clip.rate_hz),
                                       .expected = "at least one frame and a rate above 0"});
  }
}

}  // namespace

std::span<const Codec* const> all_codecs() {
  static const PoseSpaceCodec motion_space;
  static const ChannelCodec pca(pca_transform()), dwt(dwt_transform()), awt(awt_transform());
  static const ChannelCodec fourier(fourier_transform()), legendre(legendre_transform());
  static const QbcCodec qbc;
  static const RawCodec raw_zstd(Packer::zstd), raw_xz(Packer::xz);
  static const RmaCodec rma;
  static const ClipPcaCodec clip_pca;
  static const std::array<const Codec*, 11> codecs{&motion_space, &rma,     &clip_pca, &qbc,      &pca,   &dwt,
                                                   &awt,          &fourier, &legendre, &raw_zstd, &raw_xz};
  return codecs;
}

const Codec& find_codec(std::string_view name) {
  std::string names;
  for (const Codec* codec : all_codecs()) {
    if (codec->name() == name) return *codec;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", codec->name());
  }
  throw Error(ErrorKind::usage, {.found = fmt::format("codec {}", name), .expected = names});
}

const CodecSetting& find_setting(const Codec& codec, std::string_view name) {
  std::string names;
  for (const CodecSetting& setting : codec.settings()) {
    if (setting.name == name) return setting;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", setting.name);
  }
  throw Error(ErrorKind::usage, {.found = fmt::format("setting {} of codec {}", name, codec.name()),
                                 .expected = names.empty() ? "no settings" : names});
}

Bytes encode(std::string_view codec, std::span<const Clip> clips, const CodecOptions& options) {
  return encode(find_codec(codec), clips, options);
}

Bytes encode(const Codec& codec, std::span<const Clip> clips, const CodecOptions& options) {
  options.target.validate();
  check_settings(codec, options);
  check_clips(clips);
  if (options.basis != nullptr && !codec.takes_basis()) {
    throw Error(ErrorKind::usage, {.found = fmt::format("a basis for codec {}", codec.name()), .expected = "none"});
  }
  return codec.encode(clips, options);
}

bool is_clip_stream(std::span<const std::byte> bytes) {
  if (!Bitstream::has_magic(bytes)) return false;
  return Bitstream::parse_prefix(bytes, "").kind().starts_with(stream_kind(""));
}

std::string basis_of(std::span<const std::byte> bytes, std::string source) {
  const Bitstream stream = Bitstream::parse_prefix(bytes, std::move(source));
  const std::string* basis = stream.find_option("basis");
  return basis != nullptr ? *basis : std::string();
}

std::unique_ptr<StreamReader> open_stream(std::span<const std::byte> bytes, std::string source,
                                          const PoseSpaceBasis* basis) {
  Bitstream stream = Bitstream::parse_prefix(bytes, std::move(source));
  const std::string kind = stream.kind();
  for (const Codec* codec : all_codecs()) {
    if (kind != stream_kind(codec->name())) continue;
    static_cast<void>(payload_version(stream, codec->versions()));
    return codec->open_with(basis, std::move(stream));
  }
  throw Error(ErrorKind::bad_input, {.file = stream.source(),
                                     .found = "a stream of kind " + kind,
                                     .expected = "a stream of clips by a codec that this build knows"});
}

}  // namespace kinespace
