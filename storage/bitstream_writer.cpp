#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/storage/bitstream.h"
#include "kinespace/storage/detail/bitstream_format.h"
#include "kinespace/storage/detail/bitstream_version.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace format = bitstream_format;
namespace {

[[noreturn]] void refuse(std::string found, std::string expected) {
  throw Error(ErrorKind::usage, {.file = {}, .found = std::move(found), .expected = std::move(expected)});
}

void put_measured_error(ByteWriter& out, const MeasuredError& error) {
  const std::array<double, 3> values = {error.mean_joint_error_cm, error.max_joint_error_cm, error.shell_error_cm};
  std::uint8_t flags = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isnan(values[i])) flags |= static_cast<std::uint8_t>(1U << i);
  }
  out.put(flags);
  for (const double value : values) {
    if (!std::isnan(value)) out.put(static_cast<float>(value));
  }
}

Bytes join_blocks(std::span<const Bytes> blocks) {
  ByteWriter out;
  for (const Bytes& block : blocks) {
    put_varint(out, block.size());
    out.put(static_cast<format::BlockChecksum>(checksum64(block)));
    out.put_bytes(block);
  }
  return std::move(out).take();
}

}  // namespace

BitstreamWriter::BitstreamWriter(std::string kind) : kind_(std::move(kind)) {
  if (kind_.empty()) refuse("a stream without a kind", "a name of what it holds");
}

void BitstreamWriter::set_option(std::string key, std::string value) {
  options_.insert_or_assign(std::move(key), std::move(value));
  if (options_.size() > format::most_options) refuse("too many options", "at most 65536");
}

void BitstreamWriter::set_option(std::string key, const char* value) {
  set_option(std::move(key), std::string(value));
}

void BitstreamWriter::set_option(std::string key, double value) {
  set_option(std::move(key), fmt::format("{}", value));
}

void BitstreamWriter::set_option(std::string key, std::int64_t value) {
  set_option(std::move(key), fmt::format("{}", value));
}

void BitstreamWriter::add_section(std::string name, Bytes content) {
  add({.name = std::move(name), .content = std::move(content), .progressive = false});
}

void BitstreamWriter::add_progressive_section(std::string name, std::span<const Bytes> blocks) {
  add({.name = std::move(name), .content = join_blocks(blocks), .progressive = true});
}

void BitstreamWriter::add(Section section) {
  if (section.name.empty()) refuse("a section without a name", "a name");
  if (sections_.size() == format::most_sections) refuse("too many sections", "at most 65536");
  if (!names_.insert(section.name).second) refuse("a second section '" + section.name + "'", "names that differ");
  const auto plain_end = std::ranges::find(sections_, true, &Section::progressive);
  sections_.insert(section.progressive ? sections_.end() : plain_end, std::move(section));
}

Bytes BitstreamWriter::finish() const {
  ByteWriter header;
  put_short_string(header, kind_);
  put_measured_error(header, error_);
  put_varint(header, options_.size());
  for (const auto& [key, value] : options_) {
    put_short_string(header, key);
    put_short_string(header, value);
  }
  put_varint(header, sections_.size());
  for (const Section& section : sections_) {
    put_short_string(header, section.name);
    header.put(section.progressive ? format::is_progressive : std::uint8_t{0});
    put_varint(header, section.content.size());
    header.put(checksum64(section.content));
  }

  ByteWriter out;
  out.put_bytes(format::magic);
  put_varint(out, static_cast<std::uint64_t>(BitstreamVersion::newest));
  put_varint(out, header.size());
  out.put_bytes(header.bytes());
  out.put(checksum64(out.bytes()));
  for (const Section& section : sections_) out.put_bytes(section.content);
  return std::move(out).take();
}

}  // namespace kinespace
