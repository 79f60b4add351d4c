#include "kinespace/storage/bitstream.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
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

namespace {

constexpr const char* get_it_again = "get the file again from where it came from";

std::string in_quotes(std::string_view text) {
  return "'" + std::string(text) + "'";
}

constexpr auto newest_version = static_cast<std::uint64_t>(BitstreamVersion::newest);

MeasuredError get_measured_error(ByteReader& in) {
  const auto flags = in.get<std::uint8_t>();
  if ((flags & ~format::header_flags) != 0) in.fail("unknown flags in the header", "those of this format");
  MeasuredError error;
  if ((flags & format::has_mean_error) != 0) error.mean_joint_error_cm = in.get<float>();
  if ((flags & format::has_max_error) != 0) error.max_joint_error_cm = in.get<float>();
  if ((flags & format::has_shell_error) != 0) error.shell_error_cm = in.get<float>();
  return error;
}

BitstreamOptions get_options(ByteReader& in) {
  const std::size_t count = get_count(in, format::least_option_bytes, "options");
  if (count > format::most_options) in.fail(std::to_string(count) + " options", "at most 65536");
  BitstreamOptions options;
  for (std::size_t i = 0; i < count; ++i) {
    std::string key = get_short_string(in);
    std::string value = get_short_string(in);
    if (!options.empty() && key <= options.rbegin()->first) in.fail("options out of order", "each key once, sorted");
    options.emplace_hint(options.end(), std::move(key), std::move(value));
  }
  return options;
}

struct Block {
  std::span<const std::byte> content;
  format::BlockChecksum checksum = 0;
  std::span<const std::byte> rest;  // what follows the block
};

// The block that `bytes` begin with; nullopt when it is not all there.
std::optional<Block> next_block(std::span<const std::byte> bytes) {
  std::uint64_t size = 0;
  std::size_t at = 0;
  for (int shift = 0;; shift += 7) {
    if (at == bytes.size() || shift > 56) return std::nullopt;
    const auto byte = static_cast<std::uint64_t>(bytes[at++]);
    size |= (byte & 0x7fU) << shift;
    if ((byte & 0x80U) == 0) break;
  }
  Block block;
  if (bytes.size() - at < sizeof block.checksum) return std::nullopt;
  std::memcpy(&block.checksum, bytes.data() + at, sizeof block.checksum);
  at += sizeof block.checksum;
  if (size > bytes.size() - at) return std::nullopt;
  block.content = bytes.subspan(at, static_cast<std::size_t>(size));
  block.rest = bytes.subspan(at + block.content.size());
  return block;
}

template <typename Number>
bool parse_number(const std::string& text, Number& value) {
  const char* end = text.data() + text.size();
  const auto [stop, code] = std::from_chars(text.data(), end, value);
  return code == std::errc() && stop == end;
}

}  // namespace

bool Bitstream::has_magic(std::span<const std::byte> bytes) {
  return bytes.size() >= format::magic.size() && std::ranges::equal(bytes.first(format::magic.size()), format::magic);
}

Bitstream Bitstream::parse(std::span<const std::byte> bytes, std::string source) {
  return parse(bytes, std::move(source), false);
}

Bitstream Bitstream::parse_prefix(std::span<const std::byte> bytes, std::string source) {
  return parse(bytes, std::move(source), true);
}

Bitstream Bitstream::parse(std::span<const std::byte> bytes, std::string source, bool prefix_will_do) {
  Bitstream stream;
  stream.source_ = source;
  ByteReader in(bytes, std::move(source));
  const std::size_t likeness = std::min(bytes.size(), format::magic.size());
  if (!std::ranges::equal(bytes.first(likeness), std::span(format::magic).first(likeness))) {
    in.fail("not a kinespace stream", "a file that `kinespace encode` wrote");
  }
  in.take(format::magic.size());
  stream.version_ = get_varint(in);
  if (stream.version_ > newest_version) {
    stream.fail("written by a newer kinespace (format " + std::to_string(stream.version_) + ")", {},
                "this one reads up to " + std::to_string(newest_version));
  }
  if (stream.version_ == 0) in.fail("format version 0", "1 to " + std::to_string(newest_version));
  const auto header = in.take(get_count(in, 1, "bytes of header"));
  const std::size_t header_end = bytes.size() - in.remaining();
  if (in.get<std::uint64_t>() != checksum64(bytes.first(header_end))) {
    stream.fail("a damaged header (its checksum differs)", {}, get_it_again);
  }
  stream.parse_header(header);
  stream.place_sections(bytes, bytes.size() - in.remaining(), prefix_will_do);
  return stream;
}

void Bitstream::parse_header(std::span<const std::byte> header) {
  ByteReader in(header, source_);
  kind_ = get_short_string(in);
  error_ = get_measured_error(in);
  options_ = get_options(in);
  parse_table(in);
  in.expect_end();
}

void Bitstream::parse_table(ByteReader& in) {
  const std::size_t count = get_count(in, format::least_entry_bytes, "sections");
  if (count > format::most_sections) in.fail(std::to_string(count) + " sections", "at most 65536");
  sections_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Section section;
    section.name = get_short_string(in);
    const auto flags = in.get<std::uint8_t>();
    if ((flags & ~format::section_flags) != 0)
      in.fail("unknown flags of section " + in_quotes(section.name), "known ones");
    section.progressive = (flags & format::is_progressive) != 0;
    if (!section.progressive && !sections_.empty() && sections_.back().progressive) {
      in.fail("a plain section behind a progressive one", "the progressive ones last");
    }
    section.size = get_varint(in);
    section.checksum = in.get<std::uint64_t>();
    if (!by_name_.emplace(section.name, i).second)
      in.fail("two sections " + in_quotes(section.name), "names that differ");
    sections_.push_back(std::move(section));
  }
}

void Bitstream::place_sections(std::span<const std::byte> bytes, std::size_t header_size, bool prefix_will_do) {
  std::span<const std::byte> rest = bytes.subspan(header_size);
  size_ = header_size;
  available_ = bytes.size();
  for (Section& section : sections_) {
    if (section.size > std::numeric_limits<std::uint64_t>::max() - size_) fail("sizes that overflow", "true sizes");
    const bool whole = section.size <= rest.size();
    if (!whole && !(prefix_will_do && section.progressive)) {
      fail("cut short in section " + in_quotes(section.name) + ": " + std::to_string(rest.size()) + " of its bytes",
           std::to_string(section.size), get_it_again);
    }
    section.offset = size_;
    section.available = rest.first(whole ? static_cast<std::size_t>(section.size) : rest.size());
    rest = rest.subspan(section.available.size());
    size_ += section.size;
    complete_ = complete_ && whole;
  }
  if (!rest.empty()) fail(std::to_string(rest.size()) + " bytes behind the last section", "the end of the stream");
}

void Bitstream::require_kind(std::string_view kind) const {
  if (kind_ != kind) fail("a stream of kind " + in_quotes(kind_), in_quotes(kind));
}

const std::string* Bitstream::find_option(std::string_view key) const {
  const auto found = options_.find(key);
  return found == options_.end() ? nullptr : &found->second;
}

const std::string& Bitstream::option(std::string_view key) const {
  const std::string* value = find_option(key);
  if (value == nullptr) fail("no option " + in_quotes(key), "one in a stream of kind " + in_quotes(kind_));
  return *value;
}

std::int64_t Bitstream::integer_option(std::string_view key, std::int64_t least, std::int64_t most) const {
  const std::string& text = option(key);
  std::int64_t value = 0;
  if (!parse_number(text, value) || value < least || value > most) {
    fail("option " + in_quotes(key) + " = " + in_quotes(text),
         "a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return value;
}

double Bitstream::number_option(std::string_view key, double least, double most) const {
  const std::string& text = option(key);
  double value = 0;
  // Written so that NaN is refused too.
  if (!parse_number(text, value) || !(value >= least && value <= most)) {
    fail("option " + in_quotes(key) + " = " + in_quotes(text), fmt::format("a number from {} to {}", least, most));
  }
  return value;
}

std::vector<std::string> Bitstream::section_names() const {
  std::vector<std::string> names;
  names.reserve(sections_.size());
  for (const Section& section : sections_) names.push_back(section.name);
  return names;
}

std::span<const std::byte> Bitstream::section(std::string_view name) const {
  const Section& section = require(name, false);
  if (checksum64(section.available) != section.checksum) {
    fail("section " + in_quotes(name) + " is damaged (its checksum differs)", {}, get_it_again);
  }
  return section.available;
}

std::vector<std::span<const std::byte>> Bitstream::blocks(std::string_view name) const {
  const Section& section = require(name, true);
  const bool whole = section.available.size() == section.size;
  if (whole && checksum64(section.available) != section.checksum) {
    fail("section " + in_quotes(name) + " is damaged (its checksum differs)", {}, get_it_again);
  }
  std::vector<std::span<const std::byte>> blocks;
  for (std::span<const std::byte> rest = section.available; !rest.empty();) {
    const std::optional<Block> block = next_block(rest);
    if (!block && whole) fail("a damaged block in section " + in_quotes(name), "blocks that fill it", get_it_again);
    if (!block) break;
    if (static_cast<format::BlockChecksum>(checksum64(block->content)) != block->checksum) {
      fail("block " + std::to_string(blocks.size()) + " of section " + in_quotes(name) + " is damaged", {},
           get_it_again);
    }
    blocks.push_back(block->content);
    rest = block->rest;
  }
  return blocks;
}

std::uint64_t Bitstream::prefix_size(std::string_view name, std::size_t count) const {
  const std::vector<std::span<const std::byte>> found = blocks(name);
  if (count > found.size()) fail(std::to_string(found.size()) + " blocks", "at least " + std::to_string(count));
  const Section& section = require(name, true);
  if (count == 0) return section.offset;
  const std::byte* end = found[count - 1].data() + found[count - 1].size();
  return section.offset + static_cast<std::uint64_t>(end - section.available.data());
}

const Bitstream::Section* Bitstream::find(std::string_view name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? nullptr : &sections_[found->second];
}

const Bitstream::Section& Bitstream::require(std::string_view name, bool progressive) const {
  const Section* section = find(name);
  if (section == nullptr) fail("no section " + in_quotes(name), "one in a stream of kind " + in_quotes(kind_));
  if (section->progressive != progressive) {
    fail("section " + in_quotes(name) + (progressive ? " is plain" : " is progressive"),
         progressive ? "a progressive one" : "a plain one");
  }
  return *section;
}

void Bitstream::fail(std::string found, std::string expected, std::string remedy) const {
  throw Error(
      ErrorKind::bad_input,
      {.file = source_, .found = std::move(found), .expected = std::move(expected), .remedy = std::move(remedy)});
}

}  // namespace kinespace
