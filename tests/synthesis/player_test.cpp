#include "kinespace/synthesis/player.h"

#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/base/error.h"
#include "kinespace/fpca/space_builder.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

// A space and the clips it was made of, encoded with their warps.
struct Encoded {
  RegisteredSpace space;
  std::vector<EncodedClip> clips;
};

Encoded encode_all(const std::vector<PreparedClip>& clips, SpaceBuildOptions options = {}) {
  options.alignment.on_trial = false;
  BuiltSpace built = build_space(source_of(clips), options);
  Encoded out{std::move(built.space), {}};
  for (std::size_t i = 0; i < clips.size(); ++i) {
    ClipCurves curves = clips[i].curves;
    out.space.apply_references(curves.values);
    out.clips.push_back(encode(out.space, curves, built.runs_of(static_cast<int>(i), clips[i].runs), built.warps[i]));
  }
  return out;
}

Encoded sample_clips(Grouping grouping = Grouping::all_together) {
  std::vector<PreparedClip> clips;
  for (const SampleMotion& motion : sample_library({.takes = 1})) {
    if (clips.size() < 8) clips.push_back(prepare(motion.clip));
  }
  SpaceBuildOptions options;
  options.space.grouping = grouping;
  return encode_all(clips, options);
}

Encoded real_clips(const std::filesystem::path& folder, std::size_t count) {
  const auto files = find_motion_files({folder});
  std::vector<PreparedClip> clips;
  for (std::size_t i = 0; i < count; ++i) clips.push_back(prepare(read_clip(files[i * files.size() / count])));
  return encode_all(clips);
}

struct Pose {
  explicit Pose(const Player& player) : rotations(static_cast<std::size_t>(4 * player.joints())) {}
  std::vector<float> rotations;
  Eigen::Vector3f root = Eigen::Vector3f::Zero();

  [[nodiscard]] Eigen::Quaterniond rotation(int joint) const {
    const float* q = rotations.data() + static_cast<std::ptrdiff_t>(4) * joint;
    return Eigen::Quaternionf(q[0], q[1], q[2], q[3]).cast<double>();
  }
};

Pose pose_of(const Player& player, double time_s, int functions) {
  Pose out(player);
  out.root = player.pose(time_s, functions, out.rotations);
  return out;
}

// Largest difference of two poses: of the root in cm, of a rotation in radians.
struct Difference {
  double cm = 0;
  double radians = 0;
  void add(double cm_more, double radians_more) {
    cm = std::max(cm, cm_more);
    radians = std::max(radians, radians_more);
  }
};

void compare(const Pose& a, const Pose& b, Difference& out) {
  out.add(static_cast<double>((a.root - b.root).norm()), 0);
  for (int j = 0; j < static_cast<int>(a.rotations.size() / 4); ++j) {
    out.add(0, 2 * (a.rotation(j).coeffs() - b.rotation(j).coeffs()).norm());
  }
}

// Against decode() at all frames.
Difference against_decode(const RegisteredSpace& space, const EncodedClip& clip, int functions) {
  const Player player(space, clip);
  const ClipCurves curves = decode(space, clip, functions);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(curves.placement.heading_rad, Eigen::Vector3d::UnitY()));
  Difference out;
  for (int f = 0; f < clip.frames; ++f) {
    const Pose pose = pose_of(player, f / clip.rate_hz, functions);
    const auto row = curves.values.row(f);
    const Eigen::Vector3d root = curves.placement.start_cm + turn * Eigen::Vector3d(100 * row.head<3>().transpose());
    out.add((root - pose.root.cast<double>()).norm(), 0);
    for (int j = 0; j < player.joints(); ++j) {
      const auto q = row.segment<4>(3 + 4 * j);
      Eigen::Quaterniond wanted = Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized();
      if (j == 0) wanted = turn * wanted;
      out.add(0, 2 * (wanted.coeffs() - pose.rotation(j).coeffs()).norm());
    }
  }
  return out;
}

void expect_decoded(const Encoded& encoded) {
  bool warped = false;
  bool cyclic = false;
  for (const EncodedClip& clip : encoded.clips) {
    for (const EncodedRun& run : clip.runs) {
      for (const EncodedSequence& s : run.sequences) {
        warped = warped || !s.warp.is_identity();
        cyclic = cyclic || s.cycles > 1;
      }
    }
    for (const int functions : {0, 1, 3, 5, 12, -1}) {
      const Difference difference = against_decode(encoded.space, clip, functions);
      EXPECT_LT(difference.cm, 0.01) << clip.name << " at " << functions;
      EXPECT_LT(difference.radians, 1e-4) << clip.name << " at " << functions;
    }
  }
  EXPECT_TRUE(warped) << "no sequence with a warp was tried";
  EXPECT_TRUE(cyclic) << "no sequence of several cycles was tried";
}

TEST(Player, frames_of_sample_clips_are_those_of_decoding) {
  expect_decoded(sample_clips());
}

TEST(Player, frames_of_sequences_with_more_detail_are_those_of_decoding) {
  Encoded encoded = sample_clips();
  int number = 0;
  for (EncodedClip& clip : encoded.clips) {
    for (EncodedRun& run : clip.runs) {
      for (EncodedSequence& s : run.sequences) s.extra_detail = 24 * (number++ % 3);
    }
  }
  expect_decoded(encoded);
}

TEST(Player, frames_are_those_of_decoding_in_every_grouping) {
  for (const Grouping grouping : {Grouping::per_component, Grouping::per_joint_component}) {
    const Encoded encoded = sample_clips(grouping);
    for (const int functions : {1, 5, -1}) {
      const Difference difference = against_decode(encoded.space, encoded.clips[1], functions);
      EXPECT_LT(difference.cm, 0.01);
      EXPECT_LT(difference.radians, 1e-4);
    }
  }
}

TEST(Player, frames_of_cmu_are_those_of_decoding) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  expect_decoded(real_clips(data / "cmu", 4));
}

TEST(Player, frames_of_bandai_are_those_of_decoding) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  expect_decoded(real_clips(data / "bandai2", 12));
}

TEST(Player, poses_are_those_of_plain_loops) {
  const Encoded encoded = sample_clips();
  std::mt19937 generator(1);
  for (const EncodedClip& clip : encoded.clips) {
    const Player player(encoded.space, clip);
    std::uniform_real_distribution<double> time(-1, player.duration_s() + 1);
    Difference difference;
    for (int i = 0; i < 300; ++i) {
      const double t = time(generator);
      const int functions = static_cast<int>(generator() % 40) - 1;
      const Pose fast = pose_of(player, t, functions);
      Pose plain(player);
      plain.root = reference::pose(player, t, functions, plain.rotations);
      compare(fast, plain, difference);
    }
    EXPECT_LT(difference.cm, 1e-3);
    EXPECT_LT(difference.radians, 5e-6);
  }
}

TEST(Player, rotations_are_unit_quaternions_at_every_level) {
  const Encoded encoded = sample_clips();
  const Player player(encoded.space, encoded.clips[0]);
  for (int n = 0; n <= player.functions(); ++n) {
    const Pose pose = pose_of(player, 0.37, n);
    for (int j = 0; j < player.joints(); ++j) EXPECT_NEAR(pose.rotation(j).norm(), 1, 1e-6);
  }
}

// Steps of time ever smaller around each cut must give steps of pose ever smaller.
TEST(Player, nothing_jumps_at_cuts_at_any_level) {
  const Encoded encoded = sample_clips();
  int cuts = 0;
  for (const EncodedClip& clip : encoded.clips) {
    const Player player(encoded.space, clip);
    for (const EncodedRun& run : clip.runs) {
      for (std::size_t i = 1; i < run.sequences.size(); ++i, ++cuts) {
        const double cut = run.sequences[i].first / clip.rate_hz;
        for (const int functions : {0, 2, 5, -1}) {
          Difference difference;
          compare(pose_of(player, cut - 1e-6, functions), pose_of(player, cut + 1e-6, functions), difference);
          EXPECT_LT(difference.cm, 0.01) << clip.name << " at " << cut;
          EXPECT_LT(difference.radians, 2e-4) << clip.name << " at " << cut;
        }
      }
    }
  }
  EXPECT_GT(cuts, 5);
}

TEST(Player, order_and_speed_of_asking_change_nothing) {
  const Encoded encoded = sample_clips();
  const Player player(encoded.space, encoded.clips[2]);
  constexpr int steps = 101;
  std::vector<Pose> forwards;
  for (int i = 0; i < steps; ++i) forwards.push_back(pose_of(player, player.duration_s() * i / (steps - 1), 5));
  for (int i = steps - 1; i >= 0; i -= 4) {
    const Pose back = pose_of(player, player.duration_s() * i / (steps - 1), 5);
    EXPECT_EQ(back.rotations, forwards[static_cast<std::size_t>(i)].rotations);
    EXPECT_EQ(back.root, forwards[static_cast<std::size_t>(i)].root);
    static_cast<void>(pose_of(player, 0.1, 12));
  }
}

TEST(Player, times_beyond_the_ends_stop_or_start_over) {
  const Encoded encoded = sample_clips();
  const Player stops(encoded.space, encoded.clips[0]);
  const Player loops(encoded.space, encoded.clips[0], {.loop = true});
  const double end = stops.duration_s();
  EXPECT_EQ(pose_of(stops, -3, 5).rotations, pose_of(stops, 0, 5).rotations);
  EXPECT_EQ(pose_of(stops, end + 3, 5).rotations, pose_of(stops, end, 5).rotations);
  EXPECT_EQ(pose_of(loops, end, 5).rotations, pose_of(stops, end, 5).rotations);
  for (const int turns : {-2, -1, 1, 5}) {
    Difference difference;
    compare(pose_of(loops, 0.3 + turns * end, 5), pose_of(stops, 0.3, 5), difference);
    EXPECT_LT(difference.radians, 1e-4);
    EXPECT_LT(difference.cm, 1e-2);
  }
  EXPECT_TRUE(pose_of(loops, std::numeric_limits<double>::quiet_NaN(), 5).root.allFinite());
  EXPECT_TRUE(pose_of(loops, std::numeric_limits<double>::infinity(), 5).root.allFinite());
}

TEST(Player, a_break_is_a_jump_between_its_two_frames) {
  Encoded encoded = sample_clips();
  // One clip of two runs: the second run's sequences follow a frame later.
  EncodedClip clip = encoded.clips[0];
  EncodedRun second = clip.runs.front();
  const int shift = clip.frames;
  for (EncodedSequence& s : second.sequences) {
    s.first += shift;
    s.last += shift;
  }
  second.start += Eigen::Vector3f(3, 0, 0);
  clip.runs.push_back(second);
  clip.frames *= 2;
  const Player player(encoded.space, clip);
  const auto at = [&](double frame) { return pose_of(player, frame / clip.rate_hz, 5).root; };
  EXPECT_LT((at(shift - 0.6) - at(shift - 1)).norm(), 0.01F);
  EXPECT_LT((at(shift - 0.4) - at(shift)).norm(), 0.01F);
  EXPECT_GT((at(shift - 0.6) - at(shift - 0.4)).norm(), 100.0F);
}

TEST(Player, a_clip_of_one_frame_is_that_frame) {
  const Encoded encoded = sample_clips();
  const EncodedClip still = encode_clip(encoded.space, slice(sample_library({.takes = 1}).front().clip, 5, 1));
  EXPECT_LT(against_decode(encoded.space, still, -1).radians, 1e-4);
}

TEST(Player, fewer_functions_can_be_kept) {
  const Encoded encoded = sample_clips();
  const Player all(encoded.space, encoded.clips[0]);
  const Player few(std::make_shared<const PlaybackBasis>(encoded.space, 6), encoded.clips[0]);
  EXPECT_EQ(few.functions(), 6);
  EXPECT_EQ(pose_of(few, 0.7, -1).rotations, pose_of(all, 0.7, 6).rotations);
}

TEST(Player, a_clip_of_another_space_is_refused) {
  const Encoded encoded = sample_clips();
  EncodedClip other = encoded.clips[0];
  for (EncodedSequence& s : other.runs[0].sequences) s.scores.conservativeResize(Eigen::NoChange, 7);
  EXPECT_THROW(Player(encoded.space, other), Error);
  other.runs.clear();
  EXPECT_THROW(Player(encoded.space, other), Error);
}

}  // namespace
}  // namespace kinespace
