#include "codecs/registry.h"

#include <array>
#include <cmath>

#include <fmt/format.h>

#include "base/error.h"
#include "codecs/baselines/channel_codec.h"
#include "codecs/baselines/channel_transform.h"
#include "codecs/baselines/raw_codec.h"
#include "codecs/clip_pca_codec.h"
#include "codecs/motion_space_codec.h"
#include "codecs/qbc_codec.h"
#include "codecs/rma/rma_codec.h"

namespace kinespace {
namespace {

constexpr std::string_view kind_prefix = "codec:";

void require_positive(const char* field, double value) {
  if (value > 0 && std::isfinite(value)) return;
  throw Error(ErrorKind::usage,
              {.found = fmt::format("CodecTarget::{} = {}", field, value), .expected = "more than 0"});
}

void check_settings(const Codec& codec, const CodecOptions& options) {
  for (const auto& [name, value] : options.settings) {
    const CodecSetting* found = nullptr;
    std::string names;
    for (const CodecSetting& setting : codec.settings()) {
      if (setting.name == name) found = &setting;
      names += fmt::format("{}{}", names.empty() ? "" : ", ", setting.name);
    }
    if (found == nullptr) {
      throw Error(ErrorKind::usage, {.found = fmt::format("setting {} of codec {}", name, codec.name()),
                                     .expected = names.empty() ? "no settings" : names});
    }
    if (!(value >= found->least && value <= found->most)) {
      throw Error(ErrorKind::usage, {.found = fmt::format("{} = {}", name, value),
                                     .expected = fmt::format("{} to {}", found->least, found->most)});
    }
  }
}

void check_clips(std::span<const Clip> clips) {
  if (clips.empty()) throw Error(ErrorKind::usage, {.found = "no clips", .expected = "at least one"});
  for (const Clip& clip : clips) {
    if (clip.frames >= 1 && clip.rate_hz > 0 && std::isfinite(clip.rate_hz)) continue;
    throw Error(ErrorKind::bad_input, {.file = clip.name,
                                       .found = fmt::format("{} frames at {} Hz", clip.frames, clip.rate_hz),
                                       .expected = "at least one frame and a rate above 0"});
  }
}

}  // namespace

void cannot_meet(const std::string& found, std::string expected) {
  throw Error(ErrorKind::usage, {.found = "a target that cannot be met: " + found, .expected = std::move(expected)});
}

void cannot_meet(const CodecTarget& target) {
  std::string found;
  if (target.mean_error_cm) found = fmt::format("a mean joint error of {} cm", *target.mean_error_cm);
  if (target.max_error_cm) found = fmt::format("a largest joint error of {} cm", *target.max_error_cm);
  if (target.bytes) found = fmt::format("{} bytes", *target.bytes);
  cannot_meet(found, target.bytes ? "more; tables and names alone take that" : "a larger one");
}

void CodecTarget::validate() const {
  if (mean_error_cm) require_positive("mean_error_cm", *mean_error_cm);
  if (max_error_cm) require_positive("max_error_cm", *max_error_cm);
  if (bytes) require_positive("bytes", static_cast<double>(*bytes));
  const int given = (mean_error_cm ? 1 : 0) + (max_error_cm ? 1 : 0) + (bytes ? 1 : 0);
  if (given > 1) {
    throw Error(ErrorKind::usage, {.found = fmt::format("{} targets", given),
                                   .expected = "one of mean_error_cm, max_error_cm and bytes"});
  }
}

Clip StreamReader::decode_joint(std::size_t /*clip*/, int /*joint*/, int /*first*/, int /*count*/) const {
  throw Error(ErrorKind::usage, {.file = stream().source(),
                                 .found = "a stream whose joints lie together",
                                 .expected = "one of a codec that keeps them apart, as qbc"});
}

Clip StreamReader::decode_preview(std::size_t /*clip*/) const {
  throw Error(ErrorKind::usage, {.file = stream().source(),
                                 .found = "a stream without preview frames",
                                 .expected = "one of a codec that has them, as qbc"});
}

std::size_t StreamReader::find(std::string_view name) const {
  for (std::size_t i = 0; i < clips().size(); ++i) {
    if (clips()[i].name == name) return i;
  }
  throw Error(ErrorKind::usage, {.file = stream().source(),
                                 .found = fmt::format("no clip named {}", name),
                                 .expected = "one of those that `kinespace info --limit 0` lists"});
}

double Codec::setting(const CodecOptions& options, std::string_view name) const {
  const auto given = options.settings.find(name);
  if (given != options.settings.end()) return given->second;
  for (const CodecSetting& setting : settings()) {
    if (setting.name == name) return setting.initial;
  }
  throw Error(ErrorKind::usage, {.found = fmt::format("no setting {}", name), .expected = "one of the codec's"});
}

std::span<const Codec* const> all_codecs() {
  static const MotionSpaceCodec motion_space;
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

std::string stream_kind(std::string_view codec) {
  return fmt::format("{}{}", kind_prefix, codec);
}

Bytes encode(std::string_view codec, std::span<const Clip> clips, const CodecOptions& options) {
  const Codec& found = find_codec(codec);
  options.target.validate();
  check_settings(found, options);
  check_clips(clips);
  if (options.basis != nullptr && !found.takes_basis()) {
    throw Error(ErrorKind::usage, {.found = fmt::format("a basis for codec {}", codec), .expected = "none"});
  }
  return found.encode(clips, options);
}

bool is_clip_stream(std::span<const std::byte> bytes) {
  if (!Bitstream::has_magic(bytes)) return false;
  return Bitstream::parse_prefix(bytes, "").kind().starts_with(kind_prefix);
}

std::string basis_of(std::span<const std::byte> bytes, std::string source) {
  const Bitstream stream = Bitstream::parse_prefix(bytes, std::move(source));
  const std::string* basis = stream.find_option("basis");
  return basis != nullptr ? *basis : std::string();
}

std::unique_ptr<StreamReader> open_stream(std::span<const std::byte> bytes, std::string source,
                                          const MotionSpaceBasis* basis) {
  Bitstream stream = Bitstream::parse_prefix(bytes, std::move(source));
  const std::string kind = stream.kind();
  if (basis != nullptr && kind == stream_kind(MotionSpaceCodec().name())) {
    return MotionSpaceCodec().open(std::move(stream), basis);
  }
  for (const Codec* codec : all_codecs()) {
    if (kind == stream_kind(codec->name())) return codec->open(std::move(stream));
  }
  throw Error(ErrorKind::bad_input, {.file = stream.source(),
                                     .found = "a stream of kind " + kind,
                                     .expected = "a stream of clips by a codec that this build knows"});
}

}  // namespace kinespace
