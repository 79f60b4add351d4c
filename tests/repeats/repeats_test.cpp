// The choice of primary, repeated and unique clips, and the analysis as a whole.
#include "kinespace/repeats/repeats.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/rma/markers.h"
#include "kinespace/motion/read.h"
#include "tests/repeats/sample_tables.h"
#include "tests/support/allocation_meter.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::add_clip;
using test::Cycle;
using test::data_folder;
using test::empty_table;
using Kind = RepeatClip::Kind;

constexpr double repeat_rate = 60;

void expect_sound(const RepeatAnalysis& analysis, const FrameTable& table) {
  std::int64_t at = 0;
  for (const RepeatClip& clip : analysis.clips) {
    ASSERT_EQ(clip.first, at);
    ASSERT_GT(clip.last, clip.first);
    at = clip.last;
    for (const std::int64_t start : table.starts) EXPECT_FALSE(start > clip.first && start < clip.last);
    for (std::size_t s = 0; s < analysis.grouping.segments.size(); ++s) {
      const FrameSpan& segment = analysis.grouping.segments[s];
      if (segment.first >= clip.last || clip.first >= segment.last) continue;
      EXPECT_EQ(analysis.grouping.group[s], clip.group);
    }
    if (clip.kind != Kind::repeated) {
      EXPECT_EQ(clip.primary, -1);
      EXPECT_TRUE(clip.reference.empty());
      continue;
    }
    const RepeatClip& primary = analysis.clips.at(static_cast<std::size_t>(clip.primary));
    EXPECT_EQ(primary.kind, Kind::primary);
    EXPECT_EQ(primary.group, clip.group);
    ASSERT_EQ(static_cast<std::int64_t>(clip.reference.size()), clip.frames());
    EXPECT_TRUE(std::is_sorted(clip.reference.begin(), clip.reference.end()));
    EXPECT_GE(clip.reference.front(), primary.first);
    EXPECT_LT(clip.reference.back(), primary.last);
  }
  EXPECT_EQ(at, table.frames);
  EXPECT_NEAR(analysis.share(Kind::primary) + analysis.share(Kind::repeated) + analysis.share(Kind::unique), 1, 1e-12);
}

// The root mean square distance of repeated frames to those they refer to.
double reference_distance(const RepeatAnalysis& analysis, const FrameTable& table) {
  double sum = 0;
  std::int64_t count = 0;
  for (const RepeatClip& clip : analysis.clips) {
    for (std::size_t f = 0; f < clip.reference.size(); ++f, ++count) {
      const auto a = table.frame(clip.first + static_cast<std::int64_t>(f)), b = table.frame(clip.reference[f]);
      for (std::size_t d = 0; d < a.size(); ++d) sum += std::pow(static_cast<double>(a[d] - b[d]), 2);
    }
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::int64_t>(count, 1)));
}

// Numbers on a line, one a frame: distances are differences.
struct Line {
  FrameTable table = empty_table(1, 30);
  std::vector<FrameSpan> ranges;
  void add(const std::vector<double>& values) {
    add_clip(table, static_cast<int>(values.size()),
             [&](double t) { return Eigen::VectorXd::Constant(1, values[static_cast<std::size_t>(t)]); });
    ranges.push_back({table.starts.back(), table.frames});
  }
};

double deviation(const std::vector<double>& x) {
  double mean = 0, square = 0;
  for (const double v : x) mean += v / static_cast<double>(x.size());
  for (const double v : x) square += (v - mean) * (v - mean) / static_cast<double>(x.size());
  return std::sqrt(square);
}

TEST(rma_choice, costs_and_gain_are_those_of_equations_2_3_and_5) {
  const std::vector<double> first{0, 1, 4, 9, 16, 25, 36, 49}, second{2, 3, 7, 10, 18, 27, 39, 50};
  Line line;
  line.add(first);
  line.add(second);
  const GroupSpace space = fit_group_space(line.table, line.ranges);
  const SelfDistance distances(space, line.table, line.ranges, 1);
  const ChoiceOptions options{.primary_overhead_s = 0, .repeated_overhead_s = 0};

  const auto by_hand = [](const std::vector<double>& x) {
    std::vector<double> to_middle;
    for (const double v : x) to_middle.push_back(std::abs(v - x[4]));
    // The distance of a posture to itself reads as the table's least.
    return deviation(to_middle) * 8 + std::abs(x[4] - x[0]);
  };
  const double floor = distances.floor();
  EXPECT_NEAR(primary_cost(distances, 0, 8, options), by_hand(first), 4 * floor);
  EXPECT_NEAR(primary_cost(distances, 9, 17, options), by_hand(second), 4 * floor);

  PosturePath path;
  std::vector<float> apart;
  std::vector<double> apart_by_hand;
  for (int f = 0; f < 8; ++f) {
    path.points.push_back({f, 9 + f, distances.at(f, 9 + f)});
    apart.push_back(path.points.back().distance);
    apart_by_hand.push_back(std::abs(first[static_cast<std::size_t>(f)] - second[static_cast<std::size_t>(f)]));
  }
  const double repeated = deviation(apart_by_hand) * 8;
  EXPECT_NEAR(repeated_cost(distances, apart, options), repeated, 1e-3);

  const auto choices = choose_repeats(distances, std::span(&path, 1), options);
  ASSERT_EQ(choices.size(), 1U);
  ASSERT_EQ(choices[0].repetitions.size(), 1U);
  const bool first_is_primary = choices[0].first == 0;
  const double own = by_hand(first_is_primary ? first : second), other = by_hand(first_is_primary ? second : first);
  EXPECT_NEAR(choices[0].gain, (own + other) / (own + repeated), 0.05);
  // Of the two ways round, the one of the larger gain.
  EXPECT_GE(choices[0].gain, (own + other) / (other + repeated) - 0.05);
}

TEST(rma_choice, overheads_make_a_clip_cost_more) {
  Line line;
  line.add({0, 1, 4, 9, 16, 25, 36, 49});
  const GroupSpace space = fit_group_space(line.table, line.ranges);
  const SelfDistance distances(space, line.table, line.ranges, 1);
  const double without = primary_cost(distances, 0, 8, {.primary_overhead_s = 0});
  EXPECT_NEAR(primary_cost(distances, 0, 8, {.primary_overhead_s = 2}) - without, 2 * 30 * distances.typical(), 1e-6);
}

// Three walks at changing pace, in clips of their own, and something else before and after each.
FrameTable walks_between_other_things() {
  FrameTable out = empty_table(12, repeat_rate);
  const Cycle walk(12, 0);
  for (int c = 0; c < 3; ++c) {
    add_clip(out, 500, [&](double t) {
      if (t < 100 || t >= 400)
        return Eigen::VectorXd(walk(0) + test::one_way(12, (t < 100 ? 100 - t : t - 400) * (c + 1)));
      return walk((t - 100) / 60 + 0.2 * c * std::sin((t - 100) / 50));
    });
  }
  return out;
}

TEST(rma_repeats, a_walk_at_changing_pace_is_found_again) {
  const FrameTable table = walks_between_other_things();
  const RepeatAnalysis analysis = analyse_repeats(table);
  expect_sound(analysis, table);
  // 15 cycles in 1500 frames; one of them must be kept.
  EXPECT_GT(analysis.share(Kind::repeated), 0.4);
  EXPECT_LT(reference_distance(analysis, table), 0.15 * std::sqrt(2 * analysis.spaces[0].total_variance));
}

TEST(rma_repeats, a_motion_without_repetition_is_all_unique) {
  FrameTable table = empty_table(12, repeat_rate);
  add_clip(table, 1500, [](double t) { return test::one_way(12, t); });
  const RepeatAnalysis analysis = analyse_repeats(table);
  expect_sound(analysis, table);
  EXPECT_EQ(analysis.share(Kind::unique), 1);
}

TEST(rma_repeats, a_cycle_a_thousand_times_is_kept_a_few_times) {
  FrameTable table = empty_table(12, repeat_rate);
  const Cycle walk(12, 0);
  add_clip(table, 45'000, [&](double t) { return walk(t / 45); });
  const RepeatAnalysis analysis = analyse_repeats(table);
  expect_sound(analysis, table);
  EXPECT_GT(analysis.share(Kind::repeated), 0.9);
  EXPECT_LT(reference_distance(analysis, table), 1);
}

TEST(rma_repeats, a_held_pose_is_one_unique_clip) {
  FrameTable table = empty_table(12, repeat_rate);
  add_clip(table, 900, [](double /*t*/) { return Eigen::VectorXd::Constant(12, 1.5); });
  const RepeatAnalysis analysis = analyse_repeats(table);
  expect_sound(analysis, table);
  ASSERT_EQ(analysis.clips.size(), 1U);
  EXPECT_EQ(analysis.clips[0].kind, Kind::unique);
}

TEST(rma_repeats, short_motions_are_taken) {
  const Cycle walk(12, 0);
  for (const int frames : {1, 2, 10, 60}) {
    FrameTable table = empty_table(12, repeat_rate);
    add_clip(table, frames, [&](double t) { return walk(t / 20); });
    expect_sound(analyse_repeats(table), table);
  }
}

TEST(rma_repeats, many_clips_of_one_frame_are_taken) {
  const Cycle walk(12, 0);
  FrameTable table = empty_table(12, repeat_rate);
  for (int c = 0; c < 80; ++c) add_clip(table, 1, [&](double /*t*/) { return walk(c / 20.0); });
  expect_sound(analyse_repeats(table), table);
}

TEST(rma_repeats, no_clip_is_shorter_than_allowed_where_there_is_a_neighbour) {
  const FrameTable table = walks_between_other_things();
  const RepeatAnalysis analysis = analyse_repeats(table);
  for (const RepeatClip& clip : analysis.clips) EXPECT_GE(clip.frames(), 0.2 * repeat_rate - 1);
}

TEST(rma_repeats, the_number_of_threads_changes_nothing) {
  const FrameTable table = walks_between_other_things();
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return analyse_repeats(table);
  };
  const RepeatAnalysis one = with_threads(1), four = with_threads(4);
  ASSERT_EQ(one.clips.size(), four.clips.size());
  for (std::size_t c = 0; c < one.clips.size(); ++c) {
    EXPECT_EQ(one.clips[c].kind, four.clips[c].kind);
    EXPECT_EQ(one.clips[c].first, four.clips[c].first);
    EXPECT_EQ(one.clips[c].primary, four.clips[c].primary);
    EXPECT_EQ(one.clips[c].reference, four.clips[c].reference);
  }
  for (std::size_t g = 0; g < one.spaces.size(); ++g) EXPECT_EQ(one.spaces[g].axes, four.spaces[g].axes);
}

TEST(rma_repeats, a_table_too_large_is_looked_through_in_parts) {
  FrameTable table = empty_table(12, repeat_rate);
  const Cycle walk(12, 0);
  for (int c = 0; c < 7; ++c) add_clip(table, 600, [&](double t) { return walk(t / 45); });
  const RepeatAnalysis analysis = analyse_repeats(table, {.table_frames = 200});
  expect_sound(analysis, table);
  EXPECT_GT(analysis.share(Kind::repeated), 0.7);
}

TEST(rma_repeats, without_repeats_every_range_of_a_group_is_a_unique_clip) {
  const FrameTable table = walks_between_other_things();
  const RepeatAnalysis analysis = analyse_repeats(table, {.find_repeats = false});
  expect_sound(analysis, table);
  EXPECT_EQ(analysis.share(Kind::unique), 1);
}

// Two and a half hours at 120 Hz, one behaviour: the largest group there can be.
TEST(rma_repeats, memory_for_350_000_frames_stays_below_one_gibibyte) {
  const Cycle cycle(12, 3);
  FrameTable table = empty_table(12, 120);
  add_clip(table, 350'000, [&](double t) { return cycle(t / 130 + 3 * std::sin(t / 2000)); });
  const test::AllocationMeter meter;
  const RepeatAnalysis analysis = analyse_repeats(table);
  if (test::AllocationMeter::counts()) {
    EXPECT_LT(meter.peak(), std::size_t{1} << 30);
  }
  expect_sound(analysis, table);
  EXPECT_GT(analysis.share(Kind::repeated), 0.3);
}

TEST(rma_repeats, numbers_that_are_none_and_options_out_of_range_are_errors) {
  FrameTable table = walks_between_other_things();
  const auto kind_of = [&](const RepeatOptions& options) {
    try {
      static_cast<void>(analyse_repeats(table, options));
    } catch (const Error& error) {
      return error.kind();
    }
    return ErrorKind::machine;
  };
  EXPECT_EQ(kind_of({.variance = 1.5}), ErrorKind::usage);
  EXPECT_EQ(kind_of({.paths = {.threshold = 0}}), ErrorKind::usage);
  EXPECT_EQ(kind_of({.choice = {.shortest_s = 3, .longest_s = 2}}), ErrorKind::usage);
  EXPECT_EQ(kind_of({.grouping = {.alpha = -1}}), ErrorKind::usage);
  EXPECT_EQ(kind_of({.segmentation = {.window_s = std::numeric_limits<double>::quiet_NaN()}}), ErrorKind::usage);
  table.values[77] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(kind_of({}), ErrorKind::bad_input);
}

FrameTable markers_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (is_motion_file(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::vector<Clip> clips;
  for (const auto& file : files) clips.push_back(read_clip(file));
  return marker_table(clips);
}

// How much of the recordings the paper's rules find again (its own: 67 % of cmu, other clips), and how near.
void expect_repeats(const std::filesystem::path& folder, double least_share) {
  const FrameTable table = markers_of(folder);
  const RepeatAnalysis analysis = analyse_repeats(table);
  expect_sound(analysis, table);
  EXPECT_GT(analysis.share(Kind::repeated), least_share);
  EXPECT_LT(analysis.share(Kind::repeated), 0.9);
  double squares = 0;
  std::int64_t frames = 0;
  for (const RepeatClip& clip : analysis.clips) {
    squares +=
        2 * analysis.spaces[static_cast<std::size_t>(clip.group)].total_variance * static_cast<double>(clip.frames());
    frames += clip.frames();
  }
  // Two frames of a group drawn by chance are this far apart.
  const double typical = std::sqrt(squares / static_cast<double>(frames));
  EXPECT_LT(reference_distance(analysis, table), 0.4 * typical);
}

TEST(rma_repeats, walks_and_jumps_of_cmu_are_found_again) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  expect_repeats(data / "cmu" / "02", 0.4);
}

TEST(rma_repeats, climbing_of_cmu_is_found_again) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  expect_repeats(data / "cmu" / "01", 0.5);
}

}  // namespace
}  // namespace kinespace
