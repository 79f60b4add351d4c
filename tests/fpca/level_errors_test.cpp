// What each level of detail leaves, and what sequences take to stay within it.
#include "kinespace/fpca/level_errors.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "kinespace/library/detail/space_codec.h"
#include "kinespace/motion/error_measures.h"
#include "tests/fpca/sample_space.h"

namespace kinespace {
namespace {

using test::sample_clips;
using test::sample_space;

const Clip& standing() {
  const auto& clips = sample_clips();
  return *std::ranges::find(clips, "stand_calm_001", &Clip::name);
}

// Both arms flail for half a second around a time, in a way that only its number knows.
Clip flailing(Clip clip, double middle_s, unsigned number) {
  std::mt19937 random(number);
  std::uniform_real_distribution<double> uniform(0, 1);
  struct Wave {
    double hz, phase;
  };
  std::vector<Wave> waves;
  for (int i = 0; i < 5; ++i) waves.push_back({2 + 5 * uniform(random), 6.3 * uniform(random)});
  for (const char* name : {"LeftArm", "RightArm"}) {
    const int joint =
        static_cast<int>(std::ranges::find(clip.skeleton.joints, name, &Joint::name) - clip.skeleton.joints.begin());
    for (int f = 0; f < clip.frames; ++f) {
      const double t = f / clip.rate_hz - middle_s;
      double angle = 0;
      for (const Wave& w : waves) angle += 0.9 * std::exp(-16 * t * t) * std::sin(6.2831853 * w.hz * t + w.phase);
      clip.set_rotation(
          joint, f, clip.rotation(joint, f) * Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX())));
    }
  }
  return clip;
}

// Of the sample motions and of arms that flail in many ways.
const RegisteredSpace& wild_space() {
  static const RegisteredSpace space = [] {
    std::vector<PreparedClip> clips = test::prepared_samples();
    for (unsigned k = 0; k < 24; ++k) clips.push_back(prepare(flailing(standing(), 0.5 + 0.1 * k, k)));
    return build_space(source_of(clips), {}).space;
  }();
  return space;
}

struct Measured {
  EncodedClip clip;
  ClipCurves curves;
};

// As a library encodes it.
Measured encoded(const RegisteredSpace& space, const Clip& clip) {
  Measured out{encode_clip(space, clip), clip_curves(clip)};
  space.apply_references(out.curves.values);
  return out;
}

std::vector<int> details(const EncodedClip& clip) {
  std::vector<int> out;
  for (const EncodedRun& run : clip.runs) {
    for (const EncodedSequence& s : run.sequences) out.push_back(s.extra_detail);
  }
  return out;
}

TEST(LevelErrors, wild_motion_takes_more_numbers_and_the_rest_of_the_clip_none) {
  const RegisteredSpace& space = wild_space();
  const Clip wild = flailing(standing(), 2.1, 100);
  Measured m = encoded(space, wild);
  const auto worst_at = [&](int level) {
    return compare(wild, clip_from_curves(decode(space, m.clip, level), wild.skeleton)).max_joint_error_cm;
  };
  ASSERT_GT(worst_at(5), largest_error_meant(5)) << "nothing is shown here";
  measure_levels(ClipDecoder(space), m.curves, wild.skeleton, space.levels(), m.clip);
  const std::vector<int> detail = details(m.clip);
  EXPECT_GT(std::ranges::max(detail), 0);
  EXPECT_LE(std::ranges::count_if(detail, [](int x) { return x > 0; }), 2) << "of " << detail.size();
  for (const LevelError& l : m.clip.levels) {
    EXPECT_NEAR(worst_at(l.level), l.error.max_joint_error_cm, 1e-6);
    if (l.level > 10) continue;
    EXPECT_LE(l.error.max_joint_error_cm, largest_error_meant(l.level)) << l.level;
  }
}

TEST(LevelErrors, sample_motions_stay_within_what_is_meant) {
  const RegisteredSpace& space = sample_space().space;
  const ClipDecoder decoder(space);
  for (const Clip& clip : sample_clips()) {
    Measured m = encoded(space, clip);
    measure_levels(decoder, m.curves, clip.skeleton, space.levels(), m.clip);
    for (const LevelError& l : m.clip.levels) {
      if (l.level > 10) break;
      EXPECT_LE(l.error.max_joint_error_cm, largest_error_meant(l.level)) << clip.name << l.level;
    }
  }
}

TEST(LevelErrors, more_detail_is_stored_and_any_prefix_is_a_coarser_clip) {
  const RegisteredSpace& space = wild_space();
  const Clip wild = flailing(standing(), 1.3, 101);
  Measured m = encoded(space, wild);
  round_to_stored(m.clip, space);
  measure_levels(ClipDecoder(space), m.curves, wild.skeleton, space.levels(), m.clip);
  ASSERT_GT(std::ranges::max(details(m.clip)), 0);
  const PackedClip packed = pack_clip(m.clip, space);
  for (const int level : {1, 5, 10, -1}) {
    const EncodedClip back = unpack_clip(packed, space, wild.skeleton, m.clip, "test", level);
    EXPECT_EQ(details(back), details(m.clip));
    const auto with_all = m.clip.runs[0].sequences.begin();
    for (const EncodedSequence& s : back.runs[0].sequences) {
      const EncodedSequence& whole = with_all[&s - back.runs[0].sequences.data()];
      const int rows = space.of(s.cycles).rows_at(whole.level(level));
      EXPECT_EQ(s.scores.topRows(rows), whole.scores.topRows(rows)) << level;
      EXPECT_TRUE(s.scores.bottomRows(s.scores.rows() - rows).isZero(0)) << level;
    }
  }
}

TEST(LevelErrors, a_sequence_has_the_functions_that_it_needs) {
  const RegisteredSpace& space = wild_space();
  const MotionSpace& set = space.plain();
  const EncodedClip still = encoded(space, standing()).clip;
  const EncodedClip wild = encoded(space, flailing(standing(), 2.1, 100)).clip;
  const auto most_rows = [](const EncodedClip& clip) {
    Eigen::Index most = 0;
    for (const EncodedSequence& s : clip.runs[0].sequences) {
      Eigen::Index rows = s.scores.rows();
      while (rows > 0 && s.scores.row(rows - 1).isZero(0)) --rows;
      most = std::max(most, rows);
    }
    return most;
  };
  EXPECT_LT(most_rows(still), set.rows());
  EXPECT_GT(most_rows(wild), most_rows(still));

  // No more goes than half of what may be left: of curves of the set's own variance.
  ScoreMatrix scores = ScoreMatrix::Constant(set.rows(), set.curves(), 1e-4F);
  const ScoreMatrix all = scores;
  set.drop_needless(scores);
  const double gone = (all - scores).cast<double>().squaredNorm();
  const double may_go = 0.5e-6 * set.groups().front().variance * set.curves();
  EXPECT_GT(gone, 0);
  EXPECT_LE(gone, may_go);
  EXPECT_GT(gone + all.row(0).cast<double>().squaredNorm(), may_go) << "another row would be too much";
}

TEST(LevelErrors, motion_to_and_fro_from_frame_to_frame_is_kept_by_a_space_that_can) {
  Clip clip = standing();
  const int joint =
      static_cast<int>(std::ranges::find(clip.skeleton.joints, "LeftArm", &Joint::name) - clip.skeleton.joints.begin());
  for (int f = 0; f < clip.frames; ++f) {
    const double angle = 0.1 * std::sin(2.6 * f) * std::sin(0.05 * f);
    clip.set_rotation(joint, f,
                      clip.rotation(joint, f) * Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX())));
  }
  SpaceBuildOptions options;
  options.space.functions = 1024;  // all that there are
  const std::vector<PreparedClip> prepared{prepare(clip)};
  const BuiltSpace built = build_space(source_of(prepared), options);
  ClipCurves curves = prepared[0].curves;
  built.space.apply_references(curves.values);
  const EncodedClip encoded = encode(built.space, curves, built.runs_of(0, prepared[0].runs), built.warps[0]);
  const Clip decoded = clip_from_curves(decode(built.space, encoded), clip.skeleton);
  EXPECT_LT(compare(clip, decoded).max_joint_error_cm, 0.3);
}

}  // namespace
}  // namespace kinespace
