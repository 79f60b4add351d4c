#include "kinespace/storage/bitstream.h"

#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/storage/detail/bitstream_version.h"
#include "tests/storage/sample_stream.h"

namespace kinespace {
namespace {

using test::sample_blocks;
using test::sample_stream;
using test::to_bytes;
using testing::ElementsAre;
using testing::HasSubstr;

Bytes copy(std::span<const std::byte> bytes) {
  return {bytes.begin(), bytes.end()};
}

std::string message_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return {};
}

void expect_sample(const Bitstream& stream) {
  EXPECT_EQ(stream.kind(), "clip-vectors");
  EXPECT_EQ(stream.option("name"), "a \"walk\": it's 1\n");
  EXPECT_EQ(stream.integer_option("functions", 1, 100), 3);
  EXPECT_EQ(stream.number_option("rate", 0, 1000), 29.97);
  EXPECT_FLOAT_EQ(static_cast<float>(stream.error().mean_joint_error_cm), 0.25F);
  EXPECT_TRUE(std::isnan(stream.error().max_joint_error_cm));
  EXPECT_FLOAT_EQ(static_cast<float>(stream.error().shell_error_cm), 1.5F);
  EXPECT_THAT(stream.section_names(), ElementsAre("head", "empty", "scores"));
  EXPECT_EQ(copy(stream.section("head")), to_bytes("header of the clip"));
  EXPECT_TRUE(stream.section("empty").empty());
}

TEST(Bitstream, what_was_written_comes_back) {
  const Bytes bytes = sample_stream();
  const Bitstream stream = Bitstream::parse(bytes, "sample");
  expect_sample(stream);
  EXPECT_TRUE(stream.complete());
  EXPECT_EQ(stream.size(), bytes.size());
  const auto blocks = stream.blocks("scores");
  ASSERT_EQ(blocks.size(), sample_blocks().size());
  for (std::size_t i = 0; i < blocks.size(); ++i) EXPECT_EQ(copy(blocks[i]), sample_blocks()[i]);
}

TEST(Bitstream, a_stream_of_the_first_version_is_still_read) {
  const std::filesystem::path path = std::filesystem::path(KINESPACE_FIXTURES) / "bitstream_v1.ksm";
  const FileContent file(path);
  const Bitstream stream = Bitstream::parse(file.bytes(), path.string());
  EXPECT_EQ(stream.version(), 1U);
  expect_sample(stream);
  EXPECT_EQ(stream.blocks("scores").size(), sample_blocks().size());
}

// Holds the layout: a change of it needs a new version and a new fixture beside the old one.
TEST(Bitstream, the_newest_version_writes_its_fixture_to_the_byte) {
  ASSERT_EQ(BitstreamVersion::newest, BitstreamVersion::first);
  const FileContent file(std::filesystem::path(KINESPACE_FIXTURES) / "bitstream_v1.ksm");
  EXPECT_EQ(copy(file.bytes()), sample_stream());
}

TEST(Bitstream, the_same_parts_in_any_order_of_options_give_the_same_bytes) {
  BitstreamWriter a("k");
  a.set_option("x", "1");
  a.set_option("y", "2");
  BitstreamWriter b("k");
  b.set_option("y", "3");
  b.set_option("x", "1");
  b.set_option("y", "2");
  EXPECT_EQ(a.finish(), b.finish());
}

TEST(Bitstream, a_tiny_stream_is_tiny) {
  BitstreamWriter writer("qbc");
  writer.set_error({.mean_joint_error_cm = 1, .max_joint_error_cm = 2, .shell_error_cm = 3});
  writer.add_section("data", to_bytes("x"));
  EXPECT_LT(writer.finish().size(), 100U);
}

TEST(Bitstream, a_stream_cut_in_its_progressive_section_gives_the_blocks_that_are_whole) {
  const Bytes bytes = sample_stream();
  const Bitstream whole = Bitstream::parse(bytes, "sample");
  std::size_t seen = 0;
  for (std::uint64_t size = whole.prefix_size("scores", 0); size <= bytes.size(); ++size) {
    const auto prefix = std::span(bytes).first(static_cast<std::size_t>(size));
    const Bitstream stream = Bitstream::parse_prefix(prefix, "sample");
    expect_sample(stream);
    EXPECT_EQ(stream.complete(), size == bytes.size());
    EXPECT_EQ(stream.size(), bytes.size());
    const auto blocks = stream.blocks("scores");
    ASSERT_GE(blocks.size(), seen) << "more bytes never give fewer blocks";
    seen = blocks.size();
    EXPECT_GE(size, whole.prefix_size("scores", seen));
    if (seen < sample_blocks().size()) {
      EXPECT_LT(size, whole.prefix_size("scores", seen + 1));
    }
    for (std::size_t i = 0; i < seen; ++i) EXPECT_EQ(copy(blocks[i]), sample_blocks()[i]);
  }
  EXPECT_EQ(seen, sample_blocks().size());
}

TEST(Bitstream, a_cut_stream_is_an_error_to_who_wants_all_of_it) {
  const Bytes bytes = sample_stream();
  const auto prefix = std::span(bytes).first(bytes.size() - 1);
  EXPECT_THAT(message_of([&] { static_cast<void>(Bitstream::parse(prefix, "walk.ksm")); }),
              testing::AllOf(HasSubstr("walk.ksm"), HasSubstr("cut short in section 'scores'")));
}

TEST(Bitstream, plain_sections_stand_before_progressive_ones_whenever_they_are_added) {
  BitstreamWriter writer("k");
  writer.add_section("a", {});
  writer.add_progressive_section("p", sample_blocks());
  writer.add_section("b", to_bytes("b"));
  writer.add_progressive_section("q", sample_blocks());
  const Bytes bytes = writer.finish();
  const Bitstream stream = Bitstream::parse(bytes, "test");
  EXPECT_THAT(stream.section_names(), ElementsAre("a", "b", "p", "q"));
  // Cut inside "p": all of "b" is there, some of "p", none of "q".
  const std::uint64_t size = stream.prefix_size("p", 1);
  const Bitstream cut = Bitstream::parse_prefix(std::span(bytes).first(static_cast<std::size_t>(size)), "test");
  EXPECT_EQ(copy(cut.section("b")), to_bytes("b"));
  EXPECT_EQ(cut.blocks("p").size(), 1U);
  EXPECT_TRUE(cut.blocks("q").empty());
}

TEST(Bitstream, a_newer_format_says_so) {
  Bytes bytes = sample_stream();
  bytes[4] = std::byte{7};
  EXPECT_THAT(message_of([&] { static_cast<void>(Bitstream::parse(bytes, "new.ksm")); }),
              testing::StrEq("new.ksm: written by a newer kinespace (format 7); this one reads up to 1"));
}

TEST(Bitstream, a_file_of_another_sort_says_so) {
  EXPECT_THAT(message_of([] { static_cast<void>(Bitstream::parse(to_bytes("HIERARCHY\n"), "a.bvh")); }),
              HasSubstr("not a kinespace stream"));
  EXPECT_FALSE(Bitstream::has_magic(to_bytes("HIERARCHY\n")));
  EXPECT_TRUE(Bitstream::has_magic(sample_stream()));
}

TEST(Bitstream, what_is_missing_or_out_of_range_is_named) {
  const Bytes bytes = sample_stream();
  const Bitstream stream = Bitstream::parse(bytes, "sample");
  EXPECT_THAT(message_of([&] { stream.require_kind("qbc"); }), HasSubstr("'clip-vectors', expected 'qbc'"));
  EXPECT_THAT(message_of([&] { static_cast<void>(stream.section("tail")); }), HasSubstr("no section 'tail'"));
  EXPECT_THAT(message_of([&] { static_cast<void>(stream.section("scores")); }), HasSubstr("is progressive"));
  EXPECT_THAT(message_of([&] { static_cast<void>(stream.blocks("head")); }), HasSubstr("is plain"));
  EXPECT_THAT(message_of([&] { static_cast<void>(stream.option("speed")); }), HasSubstr("no option 'speed'"));
  EXPECT_THAT(message_of([&] { static_cast<void>(stream.integer_option("functions", 4, 9)); }),
              HasSubstr("option 'functions' = '3', expected a whole number from 4 to 9"));
  EXPECT_THAT(message_of([&] { static_cast<void>(stream.number_option("name", 0, 1)); }), HasSubstr("a number from"));
  EXPECT_EQ(stream.find_option("speed"), nullptr);
}

TEST(Bitstream, a_writer_refuses_names_that_are_taken_or_empty) {
  BitstreamWriter writer("k");
  writer.add_section("a", {});
  EXPECT_THROW(writer.add_section("a", {}), Error);
  EXPECT_THROW(writer.add_section("", {}), Error);
  EXPECT_THROW(BitstreamWriter(""), Error);
}

}  // namespace
}  // namespace kinespace
