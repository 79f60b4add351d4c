// Hostile bytes: every prefix, every flipped byte, and headers that are wrong but carry the right checksum.
#include <cstring>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/storage/bitstream.h"
#include "kinespace/storage/detail/bitstream_format.h"
#include "kinespace/storage/varint.h"
#include "tests/storage/sample_stream.h"

namespace kinespace {
namespace {

using test::sample_blocks;
using test::sample_stream;

struct Reading {
  bool opened = false;
  int sections = 0;  // that were read without an error
  int blocks = 0;
};

// Reads all there is. Errors must be of the one type and name the source.
template <typename Parse>
Reading read_all(Parse parse, std::span<const std::byte> bytes) {
  Reading reading;
  const auto guarded = [](const auto& act) {
    try {
      act();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      EXPECT_EQ(error.details().file, "hostile");
    }
  };
  guarded([&] {
    const Bitstream stream = parse(bytes, "hostile");
    reading.opened = true;
    for (const std::string& name : stream.section_names()) {
      guarded([&] {
        static_cast<void>(stream.section(name));
        ++reading.sections;
      });
      guarded([&] { reading.blocks += static_cast<int>(stream.blocks(name).size()); });
    }
  });
  return reading;
}

Bitstream whole(std::span<const std::byte> bytes, const char* source) {
  return Bitstream::parse(bytes, source);
}
Bitstream prefix(std::span<const std::byte> bytes, const char* source) {
  return Bitstream::parse_prefix(bytes, source);
}

TEST(BitstreamDamage, every_prefix_is_an_error_or_a_coarser_stream) {
  const Bytes bytes = sample_stream();
  const std::uint64_t least = Bitstream::parse(bytes, "sample").prefix_size("scores", 0);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    // A heap block of the very size, so that a sanitizer sees a read behind its end.
    const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(read_all(whole, cut).opened) << size;
    EXPECT_EQ(read_all(prefix, cut).opened, size >= least) << size;
  }
}

TEST(BitstreamDamage, every_flipped_byte_is_noticed) {
  const Bytes bytes = sample_stream();
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (const int mask : {0x01, 0x10, 0x80, 0xff}) {
      Bytes flipped = bytes;
      flipped[at] ^= static_cast<std::byte>(mask);
      const Reading reading = read_all(whole, flipped);
      EXPECT_TRUE(!reading.opened || reading.sections < 2 || reading.blocks == 0) << at << " " << mask;
    }
  }
}

TEST(BitstreamDamage, a_flipped_byte_in_a_cut_stream_spoils_no_block_unnoticed) {
  const Bytes bytes = sample_stream();
  const auto start = static_cast<std::size_t>(Bitstream::parse(bytes, "sample").prefix_size("scores", 0));
  for (std::size_t at = start; at + 1 < bytes.size(); ++at) {
    Bytes cut(bytes.begin(), bytes.end() - 1);
    cut[at] ^= std::byte{0x20};
    const Bitstream stream = Bitstream::parse_prefix(cut, "hostile");
    try {
      const auto blocks = stream.blocks("scores");
      ASSERT_LE(blocks.size(), sample_blocks().size());
      for (std::size_t i = 0; i < blocks.size(); ++i) {
        EXPECT_TRUE(std::ranges::equal(blocks[i], sample_blocks()[i])) << at;
      }
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    }
  }
}

// A stream around any header, with a checksum that fits.
Bytes with_header(std::span<const std::byte> header, std::span<const std::byte> sections = {}) {
  ByteWriter out;
  out.put_bytes(bitstream_format::magic);
  put_varint(out, 1);
  put_varint(out, header.size());
  out.put_bytes(header);
  out.put(checksum64(out.bytes()));
  out.put_bytes(sections);
  return std::move(out).take();
}

struct Entry {
  const char* name;
  std::uint8_t flags;
  std::uint64_t size;
};

Bytes header_of(std::initializer_list<Entry> entries, std::uint8_t header_flags = 0) {
  ByteWriter header;
  put_short_string(header, "k");
  header.put(header_flags);
  put_varint(header, 0);
  put_varint(header, entries.size());
  for (const Entry& entry : entries) {
    put_short_string(header, entry.name);
    header.put(entry.flags);
    put_varint(header, entry.size);
    header.put(checksum64({}));
  }
  return std::move(header).take();
}

TEST(BitstreamDamage, a_table_that_cannot_be_is_an_error) {
  constexpr std::uint64_t huge = std::numeric_limits<std::uint64_t>::max();
  ASSERT_TRUE(read_all(whole, with_header(header_of({{"a", 0, 0}, {"b", 1, 0}}))).opened)
      << "the frame itself is right";
  EXPECT_FALSE(read_all(whole, with_header(header_of({{"a", 0, 0}, {"a", 0, 0}}))).opened) << "a name twice";
  EXPECT_FALSE(read_all(whole, with_header(header_of({{"a", 1, 0}, {"b", 0, 0}}))).opened)
      << "plain behind progressive";
  EXPECT_FALSE(read_all(whole, with_header(header_of({{"a", 2, 0}}))).opened) << "an unknown flag of a section";
  EXPECT_FALSE(read_all(whole, with_header(header_of({}, 0x80))).opened) << "an unknown flag of the header";
  EXPECT_FALSE(read_all(prefix, with_header(header_of({{"a", 0, huge}}))).opened) << "a size that overflows";
  EXPECT_FALSE(read_all(prefix, with_header(header_of({{"a", 1, huge}, {"b", 1, huge}}))).opened) << "a sum that does";
  EXPECT_FALSE(read_all(whole, with_header(header_of({{"a", 0, 0}}), test::to_bytes("x"))).opened) << "extra bytes";
  Bytes longer = header_of({{"a", 0, 0}});
  longer.push_back(std::byte{0});
  EXPECT_FALSE(read_all(whole, with_header(longer)).opened) << "extra bytes in the header";
}

TEST(BitstreamDamage, a_count_beyond_the_bytes_is_refused_before_it_is_allocated) {
  for (const std::uint64_t count : {std::uint64_t{1} << 20, std::uint64_t{1} << 40, ~std::uint64_t{0}}) {
    ByteWriter header;
    put_short_string(header, "k");
    header.put(std::uint8_t{0});
    put_varint(header, count);  // options
    EXPECT_FALSE(read_all(whole, with_header(header.bytes())).opened);

    ByteWriter table;
    put_short_string(table, "k");
    table.put(std::uint8_t{0});
    put_varint(table, 0);
    put_varint(table, count);  // sections
    EXPECT_FALSE(read_all(whole, with_header(table.bytes())).opened);
  }
}

TEST(BitstreamDamage, random_headers_with_a_right_checksum_do_no_harm) {
  const Bytes good = header_of({{"a", 0, 3}, {"b", 1, 5}});
  const Bytes sections = test::to_bytes("abcdefgh");
  std::mt19937 random(7);
  int opened = 0;
  for (int round = 0; round < 50000; ++round) {
    Bytes header = good;
    for (unsigned change = random() % 4; change-- > 0;) {
      header[random() % header.size()] = static_cast<std::byte>(random());
    }
    const Bytes bytes = with_header(header, sections);
    opened += read_all(whole, bytes).opened ? 1 : 0;
    read_all(prefix, bytes);
  }
  EXPECT_GT(opened, 1000) << "some changes do not touch the structure";
  EXPECT_LT(opened, 49000) << "most do";
}

}  // namespace
}  // namespace kinespace
