// What damaged motion-space streams give, beyond what every codec owes (codec_damage_test.cpp).
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/pose_space/pose_space_tables.h"
#include "kinespace/storage/varint.h"
#include "tests/codecs/sample_stream.h"
#include "tests/support/forged_stream.h"

namespace kinespace {
namespace {

// True when the bytes gave clips.
bool stream_decodes(std::span<const std::byte> bytes) {
  try {
    const auto reader = open_stream(bytes, "damaged.ksm");
    for (std::size_t c = 0; c < reader->clips().size(); c += 5) {
      const Clip clip = reader->decode(c);
      EXPECT_EQ(clip.frames, reader->clips()[c].frames);
      for (const double q : clip.rotations) EXPECT_TRUE(std::isfinite(q));
    }
    return true;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
    EXPECT_NE(std::string(error.what()).find("damaged.ksm"), std::string::npos) << error.what();
    return false;
  }
}

Bytes forged(std::string_view part, const Bytes& content) {
  return test::forged(test::sample_stream(), part, content);
}

TEST(StreamDamage, every_prefix_is_a_coarser_stream_or_an_error) {
  const Bytes& stream = test::sample_stream();
  const auto whole = open_stream(stream, "s");
  const std::uint64_t least = whole->stream().prefix_size("layers", 0);
  int decoded = 0;
  for (std::size_t n = 0; n < stream.size(); n += n < 64 ? 1 : 37) {
    const bool good = stream_decodes(std::span(stream).first(n));
    EXPECT_EQ(good, n >= least) << n;
    decoded += good ? 1 : 0;
  }
  EXPECT_GT(decoded, 10);
}

TEST(StreamDamage, huge_counts_in_a_small_stream_are_refused_before_anything_is_allocated_for_them) {
  const Bitstream stream = Bitstream::parse(test::sample_stream(), "s");
  ClipTable table = unpack_clip_table(stream.section("clips"), 1 << 20, "s");
  ClipEntry& clip = table.clips.front();
  clip.blocks.assign(40000, 512);  // 20 million frames
  clip.finer.assign(40000, 0);
  EXPECT_FALSE(stream_decodes(forged("clips", pack_clip_table(table))));

  PoseSpaceTables tables = unpack_pose_space_tables(
      stream.section("tables"), static_cast<int>(table.skeletons.front().rotating_joints().size()), "s");
  tables.basis.components = 4000;
  EXPECT_FALSE(stream_decodes(forged("tables", pack_pose_space_tables(tables))));
  tables.basis.components = static_cast<int>(tables.basis.exponents.size());
  tables.step = 1e300;
  EXPECT_FALSE(stream_decodes(forged("tables", pack_pose_space_tables(tables))));

  ByteWriter layer;
  put_varint(layer, std::uint64_t{1} << 62);
  EXPECT_FALSE(stream_decodes(forged("layers", std::move(layer).take())));
}

// A stream that was cut short may say anything of how long it was: what is here of it counts.
TEST(StreamDamage, frames_are_believed_by_the_bytes_that_are_here) {
  ClipTable table = unpack_clip_table(test::part(test::sample_stream(), "clips"), 1 << 20, "s");
  table.clips.front().blocks.assign(40000, 512);  // 20 million frames
  table.clips.front().finer.assign(40000, 0);
  const Bytes many = forged("clips", pack_clip_table(table));
  const std::uint64_t beginning = Bitstream::parse(many, "s").prefix_size("layers", 0);
  const Bytes long_one = test::forged(many, "layers", Bytes(std::size_t{1} << 24, std::byte{1}));
  EXPECT_FALSE(stream_decodes(std::span(long_one).first(static_cast<std::size_t>(beginning) + 100)));
}

}  // namespace
}  // namespace kinespace
