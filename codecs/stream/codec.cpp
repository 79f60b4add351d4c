#include "kinespace/codecs/stream/codec.h"

#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

void require_positive(const char* field, double value) {
  if (value > 0 && std::isfinite(value)) return;
  throw Error(ErrorKind::usage,
              {.found = fmt::format("CodecTarget::{} = {}", field, value), .expected = "more than 0"});
}

}  // namespace

std::string stream_kind(std::string_view codec) {
  return fmt::format("codec:{}", codec);
}

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

bool CodecSetting::allows(double value) const {
  return value >= least && value <= most && (kind == Kind::number || value == std::floor(value));
}

std::string CodecSetting::text(double value) const {
  const bool in_words = kind == Kind::flag || kind == Kind::choice;
  return in_words && allows(value) ? std::string(words[static_cast<std::size_t>(value)]) : fmt::format("{}", value);
}

std::string CodecSetting::range() const {
  if (kind == Kind::flag || kind == Kind::choice) return fmt::format("{} or {}", words[0], words[1]);
  return fmt::format("{}{} to {}", kind == Kind::whole ? "a whole number from " : "", least, most);
}

double CodecSetting::parse(std::string_view text) const {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (!words[i].empty() && words[i] == text) return static_cast<double>(i);
  }
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool number = read.ec == std::errc() && read.ptr == text.data() + text.size();
  if (number && allows(value)) return value;
  throw Error(ErrorKind::usage, {.found = fmt::format("{} = {}", name, text), .expected = range()});
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

bool Codec::flag(const CodecOptions& options, std::string_view name) const {
  return setting(options, name) != 0;
}

}  // namespace kinespace
