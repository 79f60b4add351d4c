#include "kinespace/codecs/stream/clip_table.h"

#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/base/error.h"

namespace kinespace {
namespace {

ClipTable sample_table() {
  ClipTable table;
  const std::vector<std::string> names{"walk_happy_001", "walk_happy_002", "", "run", "walk_sad_\xc3\xa4_017"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    Skeleton skeleton = sample_skeleton(i < 2 ? 170 : 180);
    skeleton.joints.back().end_site = Eigen::Vector3d(1, 2, static_cast<double>(i / 3));
    ClipEntry clip{.name = names[i],
                   .skeleton = table.add_skeleton(skeleton, names[i]),
                   .rate_hz = i == 3 ? 29.97 : 60,
                   .placement = {.position = {static_cast<int>(i) * 100, 11, -3}, .heading = -5},
                   .blocks = {60, 512, 1 + static_cast<int>(i)},
                   .finer = {0, 2, 0}};
    clip.frames = 573 + static_cast<int>(i);
    if (i == 2) clip.side_tracks = {{.joint = 4, .dimensions = 3, .frames = {0, 574}, .values = {1, 2, 3, 4, 5, 6}}};
    table.clips.push_back(clip);
  }
  return table;
}

TEST(ClipTable, comes_back) {
  const ClipTable table = sample_table();
  const ClipTable back = unpack_clip_table(pack_clip_table(table), 10000, "t");
  ASSERT_EQ(back.skeletons.size(), 3U);
  ASSERT_EQ(back.clips.size(), table.clips.size());
  for (std::size_t s = 0; s < back.skeletons.size(); ++s) {
    EXPECT_TRUE(back.skeletons[s].same_tree(table.skeletons[s]));
    EXPECT_EQ(back.skeletons[s].joints.back().end_site, table.skeletons[s].joints.back().end_site);
  }
  for (std::size_t c = 0; c < back.clips.size(); ++c) {
    const ClipEntry& a = table.clips[c];
    const ClipEntry& b = back.clips[c];
    EXPECT_EQ(b.name, a.name);
    EXPECT_EQ(b.skeleton, a.skeleton);
    EXPECT_EQ(b.rate_hz, a.rate_hz);
    EXPECT_EQ(b.frames, a.frames);
    EXPECT_EQ(b.placement.position, a.placement.position);
    EXPECT_EQ(b.placement.heading, a.placement.heading);
    EXPECT_EQ(b.blocks, a.blocks);
    EXPECT_EQ(b.finer, a.finer);
    ASSERT_EQ(b.side_tracks.size(), a.side_tracks.size());
    for (std::size_t t = 0; t < a.side_tracks.size(); ++t) EXPECT_EQ(b.side_tracks[t].values, a.side_tracks[t].values);
  }
}

TEST(ClipTable, clips_of_like_names_cost_a_few_bytes_each) {
  ClipTable table = sample_table();
  const std::size_t before = pack_clip_table(table).size();
  for (int i = 0; i < 100; ++i) {
    table.clips.push_back(table.clips[0]);
    table.clips.back().name = "walk_happy_" + std::to_string(100 + i);
  }
  EXPECT_LT(pack_clip_table(table).size(), before + 100 * 8);
}

TEST(ClipTable, more_frames_than_are_believed_are_refused) {
  const Bytes packed = pack_clip_table(sample_table());
  EXPECT_THROW(static_cast<void>(unpack_clip_table(packed, 2000, "t")), Error);
}

TEST(ClipTable, every_prefix_and_every_flipped_byte_is_an_error_or_a_table) {
  const Bytes packed = pack_clip_table(sample_table());
  // The last bytes of a range code may be guessed right; the container's checksums see to those.
  for (std::size_t n = 0; n + 6 < packed.size(); ++n) {
    EXPECT_THROW(static_cast<void>(unpack_clip_table(std::span(packed).first(n), 10000, "t")), Error) << n;
  }
  for (std::size_t n = 0; n < packed.size(); ++n) {
    Bytes damaged = packed;
    damaged[n] ^= std::byte{0x10};
    try {
      const ClipTable table = unpack_clip_table(damaged, 10000, "t");
      EXPECT_LE(table.frames(), 10000);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    }
  }
}

}  // namespace
}  // namespace kinespace
