// The bitstream: one self-describing, checksummed container for everything that kinespace writes in binary, in files of
// its own (.ksm) and in the blobs of a library.
//
//   magic            4 bytes   8b 4b 53 42
//   format version   varint    storage/detail/bitstream_version.h
//   header length    varint
//   header                     kind; flags; the measured errors as floats; options, by key; the table of sections
//   checksum         8 bytes   XXH3-64 of all of the above
//   sections                   one after the other, as the table has them
//
// Numbers are little-endian, varints as storage/varint.h has them, strings a varint of their length and their bytes.
// An entry of the table: name, flags (bit 0: progressive), length (varint), XXH3-64 of the section (8 bytes).
// The container costs about 35 bytes, and 10 more for each section, besides the names and options themselves.
//
// A progressive section is a list of blocks, the most important first, each with a checksum of its own; progressive
// sections stand last. A stream that was cut short inside them still decodes, to a coarser result: parse_prefix.
//
// What the container does not do: compress, or know what is in a section.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/base/bytes.h"

namespace kinespace {

// What decoding the stream gives against what was encoded; NaN where it was not measured. Stored as 32-bit floats.
struct MeasuredError {
  static constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();

  double mean_joint_error_cm = not_measured;  // mean over joints and frames
  double max_joint_error_cm = not_measured;   // the worst joint in the worst frame
  double shell_error_cm = not_measured;       // of points on a shell around the joints, which see rotations too
};

using BitstreamOptions = std::map<std::string, std::string, std::less<>>;

// Collects the parts of a stream.
class BitstreamWriter {
 public:
  // `kind` says what the sections hold ("motion-space", "clip-vectors", "qbc"); it may not be empty.
  explicit BitstreamWriter(std::string kind);

  // Sets or replaces an option. Numbers are written so that they read back exactly.
  void set_option(std::string key, std::string value);
  void set_option(std::string key, const char* value);
  void set_option(std::string key, double value);
  void set_option(std::string key, std::int64_t value);
  void set_error(const MeasuredError& error) { error_ = error; }

  // Throws Error{usage} when the name is empty or taken. At most 65536 sections and as many options.
  void add_section(std::string name, Bytes content);
  // Stands after the plain sections, whenever it is added; several keep their order.
  void add_progressive_section(std::string name, std::span<const Bytes> blocks);

  [[nodiscard]] Bytes finish() const;

 private:
  struct Section {
    std::string name;
    Bytes content;
    bool progressive = false;
  };
  void add(Section section);

  std::string kind_;
  BitstreamOptions options_;
  MeasuredError error_;
  std::vector<Section> sections_;
  std::set<std::string, std::less<>> names_;
};

// A stream, read: a view of bytes that the caller keeps alive and unchanged. Reading is safe from several threads.
//
// Takes hostile bytes: any prefix and any change gives an Error{bad_input} that names the source, or a valid stream.
class Bitstream {
 public:
  // A whole stream: bytes that are missing or too many are errors. `source` names it in messages (the file, the row).
  // Checks the header and the sizes at once, and each section when it is asked for.
  [[nodiscard]] static Bitstream parse(std::span<const std::byte> bytes, std::string source);
  // The same for a stream that may end early, inside its progressive sections.
  [[nodiscard]] static Bitstream parse_prefix(std::span<const std::byte> bytes, std::string source);
  // Whether the bytes begin like a stream. Says nothing about the rest.
  [[nodiscard]] static bool has_magic(std::span<const std::byte> bytes);

  [[nodiscard]] std::uint64_t version() const noexcept { return version_; }
  [[nodiscard]] const std::string& kind() const noexcept { return kind_; }
  [[nodiscard]] const std::string& source() const noexcept { return source_; }
  [[nodiscard]] const BitstreamOptions& options() const noexcept { return options_; }
  [[nodiscard]] const MeasuredError& error() const noexcept { return error_; }
  // The bytes of the whole stream as it says, those of them that are here, and whether these are all.
  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
  [[nodiscard]] std::uint64_t available() const noexcept { return available_; }
  [[nodiscard]] bool complete() const noexcept { return complete_; }

  // Throws Error{bad_input} when the stream is of another kind.
  void require_kind(std::string_view kind) const;

  // nullptr when there is no such option.
  [[nodiscard]] const std::string* find_option(std::string_view key) const;
  // Throw Error{bad_input} when the option is missing, is no number or lies outside [least, most].
  [[nodiscard]] const std::string& option(std::string_view key) const;
  [[nodiscard]] std::int64_t integer_option(std::string_view key, std::int64_t least, std::int64_t most) const;
  [[nodiscard]] double number_option(std::string_view key, double least, double most) const;

  // In the stream's order.
  [[nodiscard]] std::vector<std::string> section_names() const;
  [[nodiscard]] bool has_section(std::string_view name) const { return find(name) != nullptr; }
  // False when there is no such section.
  [[nodiscard]] bool is_progressive(std::string_view name) const {
    const Section* section = find(name);
    return section != nullptr && section->progressive;
  }
  // The bytes of a plain section, checked against its checksum at every call.
  // Throws Error{bad_input} when it is missing or damaged.
  [[nodiscard]] std::span<const std::byte> section(std::string_view name) const;
  // The blocks of a progressive section: all of them, or those that are whole in a stream that was cut short.
  // Each is checked. Throws Error{bad_input} when the section is missing or damaged.
  [[nodiscard]] std::vector<std::span<const std::byte>> blocks(std::string_view name) const;
  // How many bytes of the stream hold everything up to the first `count` blocks of a progressive section.
  [[nodiscard]] std::uint64_t prefix_size(std::string_view name, std::size_t count) const;

 private:
  struct Section {
    std::string name;
    bool progressive = false;
    std::uint64_t size = 0;
    std::uint64_t checksum = 0;
    std::uint64_t offset = 0;              // of its first byte in the stream
    std::span<const std::byte> available;  // all of it, unless the stream was cut short
  };
  static Bitstream parse(std::span<const std::byte> bytes, std::string source, bool prefix_will_do);
  void parse_header(std::span<const std::byte> header);
  void parse_table(ByteReader& in);
  void place_sections(std::span<const std::byte> bytes, std::size_t header_size, bool prefix_will_do);
  [[nodiscard]] const Section* find(std::string_view name) const;
  [[nodiscard]] const Section& require(std::string_view name, bool progressive) const;
  [[noreturn]] void fail(std::string found, std::string expected, std::string remedy = {}) const;

  std::string source_;
  std::uint64_t version_ = 0;
  std::string kind_;
  BitstreamOptions options_;
  MeasuredError error_;
  std::vector<Section> sections_;
  std::map<std::string, std::size_t, std::less<>> by_name_;
  std::uint64_t size_ = 0;
  std::uint64_t available_ = 0;
  bool complete_ = true;
};

}  // namespace kinespace
