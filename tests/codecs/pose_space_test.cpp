#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/error_measures.h"
#include "tests/codecs/sample_stream.h"

namespace kinespace {
namespace {

using test::error_of;
using test::same;
using test::sample_clips;
using test::sample_stream;

TEST(PoseSpaceCodec, decoded_clips_are_full_clips) {
  const std::vector<Clip> decoded = open_stream(sample_stream(), "s")->decode_all();
  ASSERT_EQ(decoded.size(), sample_clips().size());
  for (std::size_t c = 0; c < decoded.size(); ++c) {
    const Clip& original = sample_clips()[c];
    EXPECT_EQ(decoded[c].name, original.name);
    EXPECT_EQ(decoded[c].rate_hz, original.rate_hz);
    EXPECT_EQ(decoded[c].frames, original.frames);
    EXPECT_TRUE(decoded[c].skeleton.same_tree(original.skeleton));
    for (std::size_t j = 0; j < original.skeleton.joints.size(); ++j) {
      EXPECT_LT((decoded[c].skeleton.joints[j].offset - original.skeleton.joints[j].offset).norm(), 1e-5);
    }
  }
}

TEST(PoseSpaceCodec, a_mean_error_is_met_closely_and_written_in_the_header) {
  for (const double target : {0.05, 0.5, 3.0}) {
    const Bytes stream = encode("motion-space", sample_clips(), {.target = {.mean_error_cm = target}});
    const auto reader = open_stream(stream, "s");
    const ClipErrorSums error = error_of(sample_clips(), reader->decode_all());
    EXPECT_LE(error.mean_cm(), target);
    EXPECT_GE(error.mean_cm(), 0.93 * target);
    EXPECT_LE(error.shell_cm(), 1.6 * error.mean_cm());
    EXPECT_NEAR(reader->stream().error().mean_joint_error_cm, error.mean_cm(), 1e-6 * error.mean_cm());
    EXPECT_NEAR(reader->stream().error().max_joint_error_cm, error.largest, 1e-6 * error.largest);
    EXPECT_NEAR(reader->stream().error().shell_error_cm, error.shell_cm(), 1e-6 * error.shell_cm());
  }
}

TEST(PoseSpaceCodec, the_measures_are_those_that_compare_gives) {
  const Clip decoded = open_stream(sample_stream(), "s")->decode(2);
  const MotionError measured = compare(sample_clips()[2], decoded);
  const ClipErrorSums sums = clip_error(sample_clips()[2], decoded, 0, decoded.frames, 0);
  EXPECT_NEAR(sums.mean_cm(), measured.mean_joint_error_cm, 1e-9);
  EXPECT_NEAR(sums.largest, measured.max_joint_error_cm, 1e-9);
  EXPECT_NEAR(sums.shell_cm(), measured.shell_error_cm, 1e-9);
}

TEST(PoseSpaceCodec, no_joint_is_ever_farther_off_than_the_largest_error) {
  for (const double target : {0.2, 2.0}) {
    const Bytes stream = encode("motion-space", sample_clips(), {.target = {.max_error_cm = target}});
    EXPECT_LE(error_of(sample_clips(), open_stream(stream, "s")->decode_all()).largest, target);
  }
}

TEST(PoseSpaceCodec, a_number_of_bytes_is_kept_to_and_used) {
  for (const std::int64_t target : {std::int64_t{9000}, std::int64_t{40000}}) {
    const Bytes stream = encode("motion-space", sample_clips(), {.target = {.bytes = target}});
    EXPECT_LE(static_cast<std::int64_t>(stream.size()), target);
    EXPECT_GE(static_cast<double>(stream.size()), 0.9 * static_cast<double>(target));
  }
}

TEST(PoseSpaceCodec, a_target_that_cannot_be_met_is_an_error) {
  EXPECT_THROW(static_cast<void>(encode("motion-space", sample_clips(), {.target = {.bytes = 100}})), Error);
  EXPECT_THROW(static_cast<void>(encode("motion-space", sample_clips(), {.target = {.mean_error_cm = 1e-14}})), Error);
  EXPECT_THROW(static_cast<void>(encode("motion-space", sample_clips(), {.target = {.max_error_cm = 1e-14}})), Error);
}

TEST(PoseSpaceCodec, finer_steps_come_nearer_to_the_clip) {
  double last = 1e9;
  for (const double step : {8.0, 1.0, 0.1, 0.001}) {
    const Bytes stream = encode("motion-space", sample_clips(), {.settings = {{"step", step}}});
    const double error = error_of(sample_clips(), open_stream(stream, "s")->decode_all()).mean_cm();
    EXPECT_LT(error, last / 2);
    last = error;
  }
  EXPECT_LT(last, 0.001);
}

TEST(PoseSpaceCodec, one_clip_and_a_part_of_it_decode_to_the_same_bits_as_all) {
  const Bytes stream = encode("motion-space", sample_clips(), {.settings = {{"step", 2}, {"group_frames", 300}}});
  const auto reader = open_stream(stream, "s");
  const std::vector<Clip> all = reader->decode_all();
  for (const std::size_t c : {std::size_t{0}, std::size_t{3}, all.size() - 1}) {
    EXPECT_TRUE(same(reader->decode(c), all[c]));
    EXPECT_EQ(reader->find(all[c].name), c);
    const int frames = all[c].frames;
    for (const auto& [first, count] : {std::pair(0, 1), std::pair(frames - 1, 1), std::pair(frames / 3, frames / 2)}) {
      EXPECT_TRUE(same(reader->decode(c, first, count, -1), slice(all[c], first, count))) << first << " " << count;
    }
  }
  EXPECT_THROW(static_cast<void>(reader->decode(0, 0, all[0].frames + 1, -1)), Error);
  EXPECT_THROW(static_cast<void>(reader->find("no such clip")), Error);
}

TEST(PoseSpaceCodec, a_prefix_is_the_same_motion_with_less_detail) {
  const auto whole = open_stream(sample_stream(), "s");
  ASSERT_EQ(whole->levels(), 5);
  double last = 1e9;
  for (int level = 0; level <= whole->levels(); ++level) {
    const std::size_t size = whole->stream().prefix_size("layers", static_cast<std::size_t>(level));
    const auto prefix = open_stream(std::span(sample_stream()).first(size), "s");
    EXPECT_EQ(prefix->levels(), level);
    const std::vector<Clip> from_prefix = prefix->decode_all();
    const std::vector<Clip> by_level = whole->decode_all(level);
    for (std::size_t c = 0; c < by_level.size(); ++c) EXPECT_TRUE(same(from_prefix[c], by_level[c]));
    const double error = error_of(sample_clips(), by_level).mean_cm();
    EXPECT_LE(error, last);
    last = error;
  }
  EXPECT_LE(last, 0.5);
}

TEST(PoseSpaceCodec, the_number_of_threads_changes_no_byte) {
  Bytes alone;
  std::vector<Clip> decoded_alone;
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    alone = encode("motion-space", sample_clips(), {.target = {.mean_error_cm = 0.5}});
    decoded_alone = open_stream(alone, "s")->decode_all();
  }
  EXPECT_EQ(alone, sample_stream());
  const std::vector<Clip> decoded = open_stream(sample_stream(), "s")->decode_all();
  for (std::size_t c = 0; c < decoded.size(); ++c) EXPECT_TRUE(same(decoded[c], decoded_alone[c]));
}

TEST(PoseSpaceCodec, clips_of_one_frame_of_none_that_moves_and_of_many_frames) {
  const Clip& walk = sample_clips().front();
  std::vector<Clip> clips{slice(walk, 5, 1), slice(walk, 0, 10), make_clip("still", walk.skeleton, 60, 100000)};
  const Bytes stream = encode("motion-space", clips, {.target = {.mean_error_cm = 0.1}});
  EXPECT_LT(stream.size(), 20000U);
  const std::vector<Clip> decoded = open_stream(stream, "s")->decode_all();
  EXPECT_LE(error_of(clips, decoded).mean_cm(), 0.1);
  ASSERT_EQ(decoded[2].frames, 100000);
  for (const Clip& clip : clips) {
    const std::vector<Clip> one{clip};
    const Bytes alone = encode("motion-space", one, {.target = {.mean_error_cm = 0.1}});
    EXPECT_LE(error_of(one, open_stream(alone, "s")->decode_all()).mean_cm(), 0.1);
  }
}

TEST(PoseSpaceCodec, teleports_and_somersaults_keep_to_the_bound) {
  Clip clip = slice(sample_clips().front(), 0, 150);
  auto& travel = clip.require_translation_track(0).values;
  for (std::size_t f = 70; f < travel.size(); ++f) travel[f] += Eigen::Vector3d(3000, 20, -500);
  for (int f = 0; f < clip.frames; ++f) {
    clip.set_rotation(0, f,
                      Eigen::Quaterniond(Eigen::AngleAxisd(0.2 * f, Eigen::Vector3d::UnitX())) * clip.rotation(0, f));
  }
  const std::vector<Clip> one{clip};
  const Bytes stream = encode("motion-space", one, {.target = {.max_error_cm = 1}});
  EXPECT_LE(error_of(one, open_stream(stream, "s")->decode_all()).largest, 1);
}

TEST(PoseSpaceCodec, bones_may_differ_within_a_stream_but_trees_may_not) {
  std::vector<Clip> clips{sample_clips()[0], sample_clips()[1]};
  for (Joint& joint : clips[1].skeleton.joints) joint.offset *= 1.1;
  const auto bytes = encode("motion-space", clips, {.target = {.mean_error_cm = 0.3}});
  const std::vector<Clip> decoded = open_stream(bytes, "s")->decode_all();
  EXPECT_LE(error_of(clips, decoded).mean_cm(), 0.3);
  EXPECT_GT(decoded[1].skeleton.joints[1].offset.norm(), 1.09 * decoded[0].skeleton.joints[1].offset.norm());
  clips[1].skeleton.joints[3].name = "elsewhere";
  EXPECT_THROW(static_cast<void>(encode("motion-space", clips)), Error);
}

TEST(PoseSpaceCodec, joints_that_slide_and_a_moving_ground_come_back) {
  Clip clip = sample_clips().front();
  auto& slide = clip.require_translation_track(6).values;
  for (std::size_t f = 0; f < slide.size(); ++f) slide[f].x() += 0.05 * static_cast<double>(f);
  const std::vector<Clip> one{clip};
  const Bytes stream = encode("motion-space", one, {.target = {.mean_error_cm = 0.2}});
  EXPECT_LE(error_of(one, open_stream(stream, "s")->decode_all()).mean_cm(), 0.2);
}

TEST(PoseSpaceCodec, values_that_are_no_numbers_and_endless_positions_are_refused) {
  std::vector<Clip> one{slice(sample_clips().front(), 0, 20)};
  one[0].rotations[40] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(static_cast<void>(encode("motion-space", one)), Error);
  one[0] = slice(sample_clips().front(), 0, 20);
  one[0].require_translation_track(0).values[3].x() = 1e12;
  EXPECT_THROW(static_cast<void>(encode("motion-space", one)), Error);
  one[0].require_translation_track(0).values[3].x() = 5e6;
  EXPECT_NO_THROW(static_cast<void>(encode("motion-space", one)));
}

}  // namespace
}  // namespace kinespace
