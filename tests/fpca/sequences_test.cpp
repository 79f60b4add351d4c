#include "kinespace/fpca/sequences.h"

#include <array>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/warp.h"
#include "tests/fpca/sample_space.h"

namespace kinespace {
namespace {

// Every frame once, but for the cuts that neighbours share.
void expect_covers(const std::vector<Run>& runs, int frames) {
  int next = 0;
  for (const Run& run : runs) {
    EXPECT_EQ(run.cuts.front(), next);
    for (std::size_t i = 1; i < run.cuts.size(); ++i) EXPECT_LT(run.cuts[i - 1], run.cuts[i]);
    next = run.cuts.back() + 1;
  }
  EXPECT_EQ(next, frames);
}

TEST(Sequences, that_are_cut_at_rests_last_between_the_shortest_and_the_longest_time) {
  for (const Clip& clip : test::sample_clips()) {
    const auto runs = cut_sequences(clip, {.most_cycles = 0});
    expect_covers(runs, clip.frames);
    if (clip.frames < 3 * clip.rate_hz) continue;
    for (const auto& run : runs) {
      for (int i = 0; i < run.sequence_count(); ++i) {
        const double seconds = (run.last_frame(i) - run.first_frame(i) + 1) / clip.rate_hz;
        EXPECT_GE(seconds, 0.8 - 1e-9) << clip.name;
        EXPECT_LE(seconds, 1.2 + 1e-9) << clip.name;
      }
    }
  }
}

// How far the pose of a frame is from that of another, as the mean distance of quaternions.
double pose_distance(const ClipCurves& curves, int a, int b) {
  const auto difference = curves.values.row(a) - curves.values.row(b);
  return difference.tail(difference.size() - 7).norm();  // without the root, which travels and turns
}

TEST(Sequences, of_cyclic_motion_end_in_the_pose_that_they_began_with) {
  int cyclic = 0;
  double between_ends = 0;
  double within = 0;  // from the first pose to the farthest of the first cycle
  for (const Clip& clip : test::sample_clips()) {
    const ClipCurves curves = clip_curves(clip);
    for (const kinespace::Run& run : cut_sequences(clip)) {
      for (int i = 0; i < run.sequence_count(); ++i) {
        if (run.cycles_of(i) == 0) continue;
        const int first = run.first_frame(i);
        const int last = run.last_frame(i);
        between_ends += pose_distance(curves, first, last);
        double farthest = 0;
        for (int f = first; f < first + (last - first) / run.cycles_of(i); ++f) {
          farthest = std::max(farthest, pose_distance(curves, first, f));
        }
        within += farthest;
        ++cyclic;
      }
    }
  }
  EXPECT_GT(cyclic, 5);
  EXPECT_LT(between_ends, 0.4 * within);
}

TEST(Sequences, of_equal_windows_are_as_many_and_as_long) {
  const Clip& clip = test::sample_clips().front();
  const auto registered = cut_sequences(clip).front();
  const auto windows = cut_sequences(clip, {.equal_windows = true}).front();
  ASSERT_EQ(windows.sequence_count(), registered.sequence_count());
  for (int i = 0; i < windows.sequence_count(); ++i) {
    EXPECT_EQ(windows.cycles_of(i), 0);
    EXPECT_NEAR(windows.last_frame(i) - windows.first_frame(i), (clip.frames - 1.0) / windows.sequence_count(), 1);
  }
}

TEST(Registration, leaves_each_stretch_as_cycles_or_cuts_it_at_rests) {
  std::vector<kinespace::Run> runs;
  for (const Clip& clip : test::sample_clips()) {
    runs = cut_sequences(clip);
    if (!runs.front().at_rests.empty()) break;
  }
  const std::size_t stretches = runs.front().at_rests.size();
  ASSERT_GE(stretches, 1U);
  const auto kept = apply_choice(runs, RestChoice(stretches, 0));
  EXPECT_EQ(kept.front().cuts, runs.front().cuts);
  EXPECT_EQ(kept.front().cycles, runs.front().cycles);
  const auto rests = apply_choice(runs, RestChoice(stretches, 1));
  expect_covers(rests, runs.front().cuts.back() + 1);
  for (int i = 0; i < rests.front().sequence_count(); ++i) EXPECT_EQ(rests.front().cycles_of(i), 0);
  EXPECT_EQ(both_ways(runs).size(), runs.size() + stretches);
}

TEST(Registration, cuts_what_the_space_has_no_functions_for_at_rests) {
  SpaceBuildOptions options;
  options.sequences.most_cycles = 0;
  std::vector<PreparedClip> at_rests;
  for (const Clip& clip : test::sample_clips()) at_rests.push_back(prepare(clip, options.sequences));
  const BuiltSpace plain = build_space(source_of(at_rests), options);
  for (const Clip& clip : test::sample_clips()) {
    const EncodedClip encoded = encode_clip(plain.space, clip);
    for (const EncodedRun& run : encoded.runs) {
      for (const EncodedSequence& s : run.sequences) EXPECT_EQ(s.cycles, 0);
    }
  }
}

TEST(Sequences, clips_of_one_two_and_few_frames_are_one_sequence) {
  const Clip& clip = test::sample_clips().front();
  for (const int frames : {1, 2, 3, 10}) {
    const auto runs = cut_sequences(slice(clip, 0, frames));
    ASSERT_EQ(runs.size(), 1U);
    EXPECT_EQ(runs[0].sequence_count(), 1);
    expect_covers(runs, frames);
  }
}

TEST(Sequences, a_body_at_rest_is_cut_all_the_same) {
  const Clip clip = make_clip("rest", sample_skeleton(), 30, 300);
  const auto runs = cut_sequences(clip);
  expect_covers(runs, 300);
  EXPECT_GE(runs[0].sequence_count(), 8);
}

TEST(Sequences, a_recording_is_parted_where_it_breaks) {
  Clip clip = test::sample_clips().front();
  auto& track = clip.require_translation_track(0).values;
  const int after = clip.frames / 2;
  for (int f = after + 1; f < clip.frames; ++f) track[static_cast<std::size_t>(f)].x() += 60;
  const auto runs = cut_sequences(clip);
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(runs[0].cuts.back(), after);
  expect_covers(runs, clip.frames);
}

TEST(Sequences, options_out_of_range_are_named) {
  EXPECT_THROW(SequenceOptions{.shortest_s = 0}.validate(), Error);
  EXPECT_THROW(SequenceOptions{.most_cycles = 9}.validate(), Error);
  EXPECT_THROW(SequenceOptions{.cycles = {.shortest_s = 0}}.validate(), Error);
  EXPECT_THROW((SequenceOptions{.shortest_s = 2, .longest_s = 1}.validate()), Error);
  EXPECT_THROW(SequenceOptions{.break_ratio = 1}.validate(), Error);
}

TEST(Warp, fixes_both_ends_and_inverts) {
  const Warp warp({20, -10, 5, 3, -2});
  EXPECT_EQ(warp.own_time(0), 0);
  EXPECT_NEAR(warp.own_time(1), 1, 1e-14);
  double before = 0;
  for (int i = 1; i <= 100; ++i) {
    const double s = i / 100.0;
    EXPECT_GT(warp.own_time(s), before);
    before = warp.own_time(s);
    EXPECT_NEAR(warp.space_time(before), s, 1e-12);
    EXPECT_GE(warp.slope(s), 0.5 - 1e-6);
    EXPECT_LE(warp.slope(s), 2 + 1e-6);
  }
}

TEST(Warp, slopes_beyond_the_limits_are_refused) {
  EXPECT_FALSE(Warp::legal({100, 0, 0, 0, 0}));
  EXPECT_THROW(Warp({-128, -128, -128, -128, -128}), Error);
  EXPECT_TRUE(Warp().is_identity());
}

TEST(Warp, goes_through_the_times_it_is_given) {
  const std::array times{0.15, 0.32, 0.5, 0.68, 0.85};
  const Warp warp = Warp::through(times);
  for (std::size_t k = 0; k < times.size(); ++k) {
    EXPECT_NEAR(warp.own_time(static_cast<double>(k + 1) / 6), times[k], 0.02);
  }
}

}  // namespace
}  // namespace kinespace
