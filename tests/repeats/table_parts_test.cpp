// How much self-distance table there is for how many frames.
#include "kinespace/repeats/detail/table_parts.h"

#include <numeric>

#include <gtest/gtest.h>

namespace kinespace {
namespace {

// Clips of so many frames, without values: only their lengths matter here.
FrameTable table_of(const std::vector<std::int64_t>& lengths, double rate_hz) {
  FrameTable table{.rate_hz = rate_hz, .dimensions = 1};
  for (const std::int64_t frames : lengths) {
    table.starts.push_back(table.frames);
    table.frames += frames;
  }
  return table;
}

// All of a table's clips as ranges of one group.
std::vector<FrameSpan> whole(const FrameTable& table) {
  std::vector<FrameSpan> out;
  for (std::size_t c = 0; c < table.starts.size(); ++c) {
    out.push_back({table.starts[c], c + 1 < table.starts.size() ? table.starts[c + 1] : table.frames});
  }
  return out;
}

double entries(const std::vector<TablePart>& parts) {
  double out = 0;
  for (const TablePart& part : parts) {
    double pixels = 0;
    for (const FrameSpan& range : part.ranges) pixels += static_cast<double>(range.frames()) / part.stride;
    out += pixels * pixels;
  }
  return out;
}

double entries_of_a_clip(std::int64_t frames, double rate_hz) {
  const FrameTable table = table_of({frames}, rate_hz);
  return entries(table_parts(whole(table), table, {}));
}

TEST(RmaTables, of_a_clip_that_is_ten_times_as_long_have_at_most_fourteen_times_the_entries) {
  for (const double rate : {15.0, 30.0, 60.0, 120.0, 240.0}) {
    for (const std::int64_t frames : {10'000, 20'000, 100'000}) {
      EXPECT_LE(entries_of_a_clip(10 * frames, rate), 14 * entries_of_a_clip(frames, rate)) << frames << " " << rate;
    }
  }
}

TEST(RmaTables, of_ordinary_clips_is_one_that_compares_all_of_them) {
  const FrameTable table = table_of({9000, 300, 10'000, 12'000}, 120);
  const auto parts = table_parts(whole(table), table, {});
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts.front().ranges, whole(table));
  EXPECT_EQ(parts.front().stride, 8);
}

TEST(RmaTables, hold_every_frame_of_a_group_once) {
  const FrameTable table = table_of({500, 123'457, 9000, 40'000, 77}, 60);
  std::vector<FrameSpan> ranges;  // two of each clip, with a gap
  for (const FrameSpan& clip : whole(table)) {
    ranges.push_back({clip.first, clip.first + clip.frames() / 3});
    ranges.push_back({clip.first + clip.frames() / 2, clip.last});
  }
  std::vector<int> seen(static_cast<std::size_t>(table.frames), 0);
  for (const FrameSpan& range : ranges) {
    for (std::int64_t f = range.first; f < range.last; ++f) --seen[static_cast<std::size_t>(f)];
  }
  for (const TablePart& part : table_parts(ranges, table, {})) {
    for (const FrameSpan& range : part.ranges) {
      for (std::int64_t f = range.first; f < range.last; ++f) ++seen[static_cast<std::size_t>(f)];
    }
  }
  EXPECT_TRUE(std::ranges::all_of(seen, [](int times) { return times == 0; }));
}

}  // namespace
}  // namespace kinespace
