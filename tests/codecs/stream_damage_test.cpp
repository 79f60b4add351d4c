// What streams that were cut short, changed or made to harm give: an error that names the file, or clips.
#include <gtest/gtest.h>

#include "base/error.h"
#include "codecs/motion_space_tables.h"
#include "storage/varint.h"
#include "tests/codecs/sample_stream.h"

namespace kinespace {
namespace {

// True when the bytes gave clips.
bool decodes(std::span<const std::byte> bytes) {
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

// The stream with one of its parts replaced, under checksums that fit.
Bytes forged(std::string_view section, const Bytes& content) {
  const Bitstream stream = Bitstream::parse(test::sample_stream(), "s");
  BitstreamWriter out(stream.kind());
  for (const char* name : {"clips", "tables"}) {
    const auto bytes = stream.section(name);
    out.add_section(name, section == name ? content : Bytes(bytes.begin(), bytes.end()));
  }
  std::vector<Bytes> layers;
  for (const auto block : stream.blocks("layers")) layers.emplace_back(block.begin(), block.end());
  if (section == "layers") layers[0] = content;
  out.add_progressive_section("layers", layers);
  return out.finish();
}

Bytes section_of(const char* name) {
  const Bitstream stream = Bitstream::parse(test::sample_stream(), "s");
  const auto bytes = std::string_view(name) == "layers" ? stream.blocks("layers")[0] : stream.section(name);
  return {bytes.begin(), bytes.end()};
}

TEST(StreamDamage, every_prefix_is_a_coarser_stream_or_an_error) {
  const Bytes& stream = test::sample_stream();
  const auto whole = open_stream(stream, "s");
  const std::uint64_t least = whole->stream().prefix_size("layers", 0);
  int decoded = 0;
  for (std::size_t n = 0; n < stream.size(); n += n < 64 ? 1 : 37) {
    const bool good = decodes(std::span(stream).first(n));
    EXPECT_EQ(good, n >= least) << n;
    decoded += good ? 1 : 0;
  }
  EXPECT_GT(decoded, 10);
}

TEST(StreamDamage, every_flipped_byte_is_noticed) {
  Bytes stream = test::sample_stream();
  for (std::size_t n = 0; n < stream.size(); n += n < 64 ? 1 : 13) {
    stream[n] ^= std::byte{0x04};
    EXPECT_FALSE(decodes(stream)) << n;
    stream[n] ^= std::byte{0x04};
  }
}

TEST(StreamDamage, extra_bytes_are_refused) {
  Bytes stream = test::sample_stream();
  stream.push_back(std::byte{0});
  EXPECT_FALSE(decodes(stream));
}

TEST(StreamDamage, forged_parts_with_fitting_checksums_are_errors_or_clips) {
  ASSERT_TRUE(decodes(forged("", {})));
  int errors = 0;
  for (const char* name : {"clips", "tables", "layers"}) {
    const Bytes part = section_of(name);
    for (std::size_t n = 0; n < part.size(); n += 1 + part.size() / 60) {
      Bytes changed = part;
      changed[n] ^= std::byte{0x21};
      errors += decodes(forged(name, changed)) ? 0 : 1;
      changed = part;
      changed.resize(n);
      errors += decodes(forged(name, changed)) ? 0 : 1;
    }
    EXPECT_FALSE(decodes(forged(name, {})));
  }
  EXPECT_GT(errors, 100);
}

TEST(StreamDamage, huge_counts_in_a_small_stream_are_refused_before_anything_is_allocated_for_them) {
  const Bitstream stream = Bitstream::parse(test::sample_stream(), "s");
  ClipTable table = unpack_clip_table(stream.section("clips"), 1 << 20, "s");
  ClipEntry& clip = table.clips.front();
  clip.blocks.assign(40000, 512);  // 20 million frames
  clip.finer.assign(40000, 0);
  EXPECT_FALSE(decodes(forged("clips", pack_clip_table(table))));

  MotionSpaceTables tables = unpack_motion_space_tables(
      stream.section("tables"), static_cast<int>(table.skeletons.front().rotating_joints().size()), "s");
  tables.basis.components = 4000;
  EXPECT_FALSE(decodes(forged("tables", pack_motion_space_tables(tables))));
  tables.basis.components = static_cast<int>(tables.basis.exponents.size());
  tables.step = 1e300;
  EXPECT_FALSE(decodes(forged("tables", pack_motion_space_tables(tables))));

  ByteWriter layer;
  put_varint(layer, std::uint64_t{1} << 62);
  EXPECT_FALSE(decodes(forged("layers", std::move(layer).take())));
}

}  // namespace
}  // namespace kinespace
