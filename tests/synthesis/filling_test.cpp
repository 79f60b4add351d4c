#include "kinespace/synthesis/filling.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/base/error.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"
#include "tests/support/data.h"
#include "tests/support/library_folder.h"

namespace kinespace::test {
namespace {

using ::testing::HasSubstr;

PreparedSource source_of_clips(const std::vector<Clip>& clips) {
  return {static_cast<int>(clips.size()), [&clips](int i) {
            const Clip& clip = clips[static_cast<std::size_t>(i)];
            return PreparedClip{.skeleton = clip.skeleton, .curves = clip_curves(clip), .runs = {}};
          }};
}

std::vector<Clip> walks(double rate_hz = 60) {
  std::vector<Clip> out;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const double phase = static_cast<double>(seed) / 12;
    out.push_back(
        make_walk({.speed_m_s = 1.0 + 0.05 * static_cast<double>(seed),
                   .start_phase = phase,
                   .duration_s = 4,
                   .take = {.rate_hz = rate_hz, .heading_deg = 30.0 * static_cast<double>(seed), .seed = seed}})
            .clip);
  }
  return out;
}

const FillModel& walk_model() {
  static const FillModel model = [] {
    const std::vector<Clip> clips = walks();
    return FillModel::build(source_of_clips(clips), {.calibration_gaps = 16});
  }();
  return model;
}

Clip unseen_walk(double rate_hz = 60) {
  return make_walk({.speed_m_s = 1.33,
                    .start_phase = 0.4,
                    .duration_s = 4,
                    .take = {.rate_hz = rate_hz, .heading_deg = 200, .seed = 99}})
      .clip;
}

Clip with_hole(Clip clip, FrameRange gap) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int f = gap.first_frame; f <= gap.last_frame; ++f) {
    for (int j = 0; j < clip.skeleton.joint_count(); ++j) clip.set_rotation(j, f, {nan, nan, nan, nan});
    for (auto& track : clip.translations) track.values[static_cast<std::size_t>(f)].setConstant(nan);
  }
  return clip;
}

double gap_error(const Clip& truth, const Clip& other, FrameRange gap) {
  return compare(slice(truth, gap.first_frame, gap.count()), slice(other, gap.first_frame, gap.count()))
      .mean_joint_error_cm;
}

// Largest second difference of any joint's position over frames [from, to], cm.
double largest_bend(const Clip& clip, int from, int to) {
  const JointPositions p = joint_positions(clip);
  double out = 0;
  for (int f = std::max(from, 1); f <= std::min(to, clip.frames - 2); ++f) {
    for (int j = 0; j < p.joints; ++j) out = std::max(out, (p.at(f + 1, j) - 2 * p.at(f, j) + p.at(f - 1, j)).norm());
  }
  return out;
}

std::string bad_input_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::bad_input) << e.what();
    return e.what();
  }
  return "accepted";
}

TEST(Filling, finds_a_step_that_slerp_cannot) {
  const Clip truth = unseen_walk();
  for (const double gap_s : {0.5, 1.0}) {
    const FrameRange gap{90, 90 + static_cast<int>(gap_s * 60) - 1};
    const Clip holed = with_hole(truth, gap);
    const FillResult filled = fill(walk_model(), holed, gap);
    const double slerp = gap_error(truth, interpolate_gap(holed, gap), gap);
    EXPECT_LT(gap_error(truth, filled.clip, gap), 0.25 * slerp) << gap_s;
  }
}

TEST(Filling, leaves_every_seen_frame_as_it_was) {
  const Clip truth = unseen_walk();
  const FrameRange gap{100, 140};
  const Clip filled = fill(walk_model(), with_hole(truth, gap), gap).clip;
  for (const int f : {0, 57, 99, 141, truth.frames - 1}) {
    for (int j = 0; j < truth.skeleton.joint_count(); ++j) {
      EXPECT_EQ(truth.rotation(j, f).coeffs(), filled.rotation(j, f).coeffs());
      EXPECT_EQ(truth.translation(j, f), filled.translation(j, f));
    }
  }
}

TEST(Filling, does_not_look_at_what_stands_in_the_gap) {
  const Clip truth = unseen_walk();
  const FrameRange gap{100, 140};
  const Clip a = fill(walk_model(), truth, gap).clip;
  const Clip b = fill(walk_model(), with_hole(truth, gap), gap).clip;
  EXPECT_EQ(a.rotations, b.rotations);
}

TEST(Filling, meets_the_edges_in_place_and_speed) {
  for (const double rate : {30.0, 60.0, 120.0}) {
    const Clip truth = unseen_walk(rate);
    const int first = static_cast<int>(1.5 * rate);
    const FrameRange gap{first, first + static_cast<int>(0.8 * rate)};
    const Clip filled = fill(walk_model(), with_hole(truth, gap), gap).clip;
    // A jump in place or speed at an edge would be a bend far above those of the walk itself.
    EXPECT_LT(largest_bend(filled, gap.first_frame - 2, gap.last_frame + 2), 1.3 * largest_bend(truth, 0, truth.frames))
        << rate;
  }
}

TEST(Filling, is_the_same_wherever_the_clip_stands_and_looks) {
  const Clip truth = unseen_walk();
  const FrameRange gap{100, 140};
  Clip moved = truth;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(2.1, Eigen::Vector3d::UnitY()));
  for (int f = 0; f < moved.frames; ++f) {
    moved.set_rotation(0, f, turn * truth.rotation(0, f));
    moved.require_translation_track(0).values[static_cast<std::size_t>(f)] =
        turn * truth.translation(0, f) + Eigen::Vector3d(500, 0, -300);
  }
  const JointPositions a = joint_positions(fill(walk_model(), truth, gap).clip);
  const JointPositions b = joint_positions(fill(walk_model(), moved, gap).clip);
  double apart = 0;
  for (int f = gap.first_frame; f <= gap.last_frame; ++f) {
    for (int j = 0; j < a.joints; ++j) {
      apart = std::max(apart, (turn * a.at(f, j) + Eigen::Vector3d(500, 0, -300) - b.at(f, j)).norm());
    }
  }
  EXPECT_LT(apart, 0.2);  // features are kept in single precision
}

TEST(Filling, fills_several_gaps_and_one_of_a_single_frame) {
  const Clip truth = unseen_walk(120);
  const std::vector<FrameRange> gaps = {{60, 60}, {150, 200}, {205, 240}};
  Clip holed = truth;
  for (const FrameRange& gap : gaps) holed = with_hole(std::move(holed), gap);
  const FillResult filled = fill(walk_model(), holed, gaps);
  ASSERT_EQ(filled.gaps.size(), 3U);
  EXPECT_EQ(filled.gaps[0].windows, 0);  // no frame of 30 Hz in it
  EXPECT_LT(gap_error(truth, filled.clip, gaps[0]), 0.02);
  for (const FrameRange& gap : gaps) EXPECT_LT(gap_error(truth, filled.clip, gap), 3) << gap.first_frame;
  EXPECT_EQ(filled.gaps[1].std_cm.rows(), 51);
  EXPECT_TRUE(missing_frames(filled.clip).empty());
}

TEST(Filling, is_surest_at_the_edges_and_less_sure_of_longer_gaps) {
  const Clip truth = unseen_walk();
  const auto spread = [&](int frames) { return fill(walk_model(), truth, {90, 90 + frames - 1}).gaps.front().std_cm; };
  const Eigen::MatrixXf s = spread(60);
  EXPECT_TRUE((s.array() >= 0).all() && s.allFinite());
  EXPECT_LT(s.row(0).mean(), 0.5F * s.row(30).mean());
  EXPECT_LT(s.row(59).mean(), 0.5F * s.row(30).mean());
  EXPECT_LT(spread(15).maxCoeff(), s.maxCoeff());
  EXPECT_LT(walk_model().interval(0.5), walk_model().interval(0.95));
}

TEST(Filling, knows_its_errors_without_calibration_as_a_normal_distribution) {
  const std::vector<Clip> clips = walks();
  const FillModel model = FillModel::build(source_of_clips(clips), {.calibration_gaps = 0});
  EXPECT_NEAR(model.interval(0.5), 0.6745, 1e-3);
  EXPECT_NEAR(model.interval(0.95), 1.9600, 1e-3);
}

TEST(Filling, joins_two_clips_in_the_direction_they_walk) {
  const Clip whole = unseen_walk();
  const Clip a = slice(whole, 0, 90);
  const Clip b = slice(walks()[3], 20, 100);  // looks elsewhere, stands elsewhere
  const FillResult joined = fill_between(walk_model(), a, b, {.gap_s = 0.5});
  EXPECT_EQ(joined.clip.frames, 90 + 29 + 100);
  const JointPositions p = joint_positions(joined.clip);
  const auto velocity = [&](int from, int to) { return Eigen::Vector3d(p.at(to, 0) - p.at(from, 0)); };
  const Eigen::Vector3d before = velocity(30, 89);
  const Eigen::Vector3d after = velocity(119, 178);
  EXPECT_GT(before.normalized().dot(after.normalized()), std::cos(0.35));
  EXPECT_NEAR(velocity(89, 119).norm(), before.norm() / 59 * 30, 0.3 * before.norm() / 59 * 30);
  EXPECT_LT(largest_bend(joined.clip, 85, 125), 2 * largest_bend(whole, 0, whole.frames));
  const FillResult kept = fill_between(walk_model(), a, b, {.gap_s = 0.5, .keep_placement = true});
  EXPECT_EQ(kept.clip.translation(0, 119), b.translation(0, 0));
}

TEST(Filling, refuses_what_it_cannot_fill_and_says_why) {
  const Clip clip = unseen_walk();
  const auto refusal = [&](FrameRange gap) { return bad_input_of([&] { (void)fill(walk_model(), clip, gap); }); };
  EXPECT_THAT(refusal({0, 10}), HasSubstr("0 seen frames before the gap"));
  EXPECT_THAT(refusal({1, 10}), HasSubstr("at least 2 on each side"));
  EXPECT_THAT(refusal({100, clip.frames - 1}), HasSubstr("after the gap"));
  EXPECT_THAT(refusal({100, clip.frames}), HasSubstr("frames of the clip"));
  EXPECT_THAT(refusal({100, 99}), HasSubstr("frames of the clip"));
  EXPECT_THAT(bad_input_of([&] {
                const std::vector<FrameRange> gaps = {{50, 60}, {62, 70}};
                (void)fill(walk_model(), clip, gaps);
              }),
              HasSubstr("1 seen frames before the gap at frame 62"));
  EXPECT_THAT(bad_input_of([&] {
                (void)fill(walk_model(), with_hole(clip, {30, 30}), {50, 60});
              }),
              HasSubstr("not finite in frame 30"));
}

TEST(Filling, refuses_gaps_longer_than_it_knows_about) {
  const Clip clip = make_walk({.duration_s = 8, .take = {.rate_hz = 60}}).clip;
  const std::vector<Clip> clips = walks();
  const FillModel impatient = FillModel::build(source_of_clips(clips), {.max_gap_s = 1, .calibration_gaps = 0});
  EXPECT_THAT(bad_input_of([&] { (void)fill(impatient, clip, {100, 180}); }), HasSubstr("at most 1 s"));
  const FillModel patient =
      FillModel::build(source_of_clips(clips), {.own_frames = false, .max_gap_s = 6, .calibration_gaps = 0});
  EXPECT_THAT(bad_input_of([&] { (void)fill(patient, clip, {100, 400}); }), HasSubstr("add longer clips"));
}

TEST(Filling, refuses_other_skeletons_and_empty_libraries) {
  Clip other = unseen_walk();
  other.skeleton.joints[3].name = "Rib";
  EXPECT_THAT(bad_input_of([&] { (void)fill(walk_model(), other, {100, 140}); }), HasSubstr("another skeleton"));
  EXPECT_THROW((void)FillModel::build(PreparedSource{}), Error);
  const std::vector<Clip> mixed = {unseen_walk(), other};
  EXPECT_THAT(bad_input_of([&] { (void)FillModel::build(source_of_clips(mixed)); }), HasSubstr("one joint tree"));
  EXPECT_THROW((FillOptions{.near_windows = 3}).validate(), Error);
  EXPECT_THROW((FillOptions{.near_windows = 50, .far_windows = 20}).validate(), Error);
  EXPECT_THROW((void)fill_between(walk_model(), unseen_walk(), unseen_walk(), {.gap_s = -1}), Error);
  EXPECT_THROW((void)fill_between(walk_model(), unseen_walk(60), unseen_walk(30)), Error);
}

TEST(Filling, learns_from_a_library_file) {
  const LibraryFolder folder;
  (void)folder.build();
  LibraryView library(folder.library());
  const Clip truth = unseen_walk();
  const FillModel model = FillModel::build(library, truth.skeleton, {.calibration_gaps = 4});
  EXPECT_EQ(model.clips(), folder.count());
  const FrameRange gap{100, 140};
  const double slerp = gap_error(truth, interpolate_gap(truth, gap), gap);
  EXPECT_LT(gap_error(truth, fill(model, truth, gap).clip, gap), 0.5 * slerp);
  Skeleton other = truth.skeleton;
  other.joints[3].name = "Rib";
  EXPECT_THAT(bad_input_of([&] { (void)FillModel::build(library, other); }), HasSubstr("no clip of this skeleton"));
}

TEST(MissingFrames, are_held_zero_or_no_numbers) {
  const Clip whole = unseen_walk();
  EXPECT_TRUE(missing_frames(whole).empty());
  Clip held = whole;
  for (int f = 51; f < 60; ++f) {
    for (int j = 0; j < held.skeleton.joint_count(); ++j) held.set_rotation(j, f, held.rotation(j, 50));
    for (auto& t : held.translations) t.values[static_cast<std::size_t>(f)] = t.values[50];
  }
  EXPECT_EQ(missing_frames(held), (std::vector<FrameRange>{{51, 59}}));
  EXPECT_TRUE(missing_frames(held, 10).empty());
  Clip zero = whole;
  for (int f = 80; f < 83; ++f) {
    for (int j = 0; j < zero.skeleton.joint_count(); ++j) zero.set_rotation(j, f, Eigen::Quaterniond::Identity());
    for (auto& t : zero.translations) t.values[static_cast<std::size_t>(f)].setZero();
  }
  EXPECT_EQ(missing_frames(zero), (std::vector<FrameRange>{{80, 82}}));
  EXPECT_EQ(missing_frames(with_hole(held, {60, 60})), (std::vector<FrameRange>{{51, 60}}));
  EXPECT_TRUE(missing_frames(make_clip("still", whole.skeleton, 60, 50)).empty());
}

TEST(FillingRealData, beats_slerp_by_half_and_knows_how_sure_it_is) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  std::vector<Clip> library;
  std::vector<Clip> held_out;
  int number = 0;
  for (const auto& file : find_motion_files({data / "bandai2"})) {
    if (++number % 5 != 0) continue;  // a fifth of the clips keeps this short
    ((number / 5) % 7 == 0 ? held_out : library).push_back(read_clip(file));
  }
  const FillModel model = FillModel::build(source_of_clips(library), {.calibration_gaps = 32});
  double ours = 0;
  double slerp = 0;
  double inside = 0;
  double all = 0;
  for (const Clip& truth : held_out) {
    if (truth.frames < 70) continue;
    const FrameRange gap{truth.frames / 2 - 15, truth.frames / 2 + 14};
    const FillResult filled = fill(model, with_hole(truth, gap), gap);
    ours += gap_error(truth, filled.clip, gap);
    slerp += gap_error(truth, interpolate_gap(truth, gap), gap);
    const JointPositions a = joint_positions(truth);
    const JointPositions b = joint_positions(filled.clip);
    for (int f = 0; f < gap.count(); ++f) {
      for (int j = truth.skeleton.travel_root(); j < a.joints; ++j) {
        const Eigen::Vector3d apart = a.at(gap.first_frame + f, j) - b.at(gap.first_frame + f, j);
        const double half = model.interval(0.8) * filled.gaps.front().std_cm(f, j);
        inside += static_cast<double>((apart.array().abs() <= half).count());
        all += 3;
      }
    }
  }
  ASSERT_GT(all, 0);
  EXPECT_LT(ours, 0.44 * slerp);
  EXPECT_NEAR(inside / all, 0.8, 0.1);  // 25 gaps; `bench filling` counts them all
}

}  // namespace
}  // namespace kinespace::test
