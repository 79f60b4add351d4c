// The codecs that papers compare with: what each promises. Damage is in codec_damage_test.cpp, for all codecs.
#include <cmath>
#include <map>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/error_measures.h"
#include "tests/codecs/sample_stream.h"

namespace kinespace {
namespace {

std::vector<Clip> some_clips() {
  return {test::sample_clips().begin(), test::sample_clips().begin() + 3};
}

class BaselineCodec : public testing::TestWithParam<const char*> {};

TEST_P(BaselineCodec, mean_error_is_met_and_not_by_far) {
  const std::vector<Clip> clips = some_clips();
  for (const double target : {0.05, 0.8}) {
    const Bytes stream = encode(GetParam(), clips, {.target = {.mean_error_cm = target}});
    const auto reader = open_stream(stream, "s");
    const ClipErrorSums error = test::error_of(clips, reader->decode_all());
    EXPECT_LE(error.mean_cm(), target);
    EXPECT_GE(error.mean_cm(), 0.5 * target);  // numbers of eigenvectors and of coefficients are whole
    EXPECT_NEAR(reader->stream().error().mean_joint_error_cm, error.mean_cm(), 1e-6);
  }
}

TEST_P(BaselineCodec, largest_error_is_met) {
  const std::vector<Clip> clips = some_clips();
  const Bytes stream = encode(GetParam(), clips, {.target = {.max_error_cm = 2}});
  EXPECT_LE(test::error_of(clips, open_stream(stream, "s")->decode_all()).largest, 2);
}

TEST_P(BaselineCodec, bytes_are_met_and_used) {
  const std::vector<Clip> clips = some_clips();
  const auto size = static_cast<std::int64_t>(encode(GetParam(), clips, {.target = {.mean_error_cm = 0.4}}).size());
  const Bytes stream = encode(GetParam(), clips, {.target = {.bytes = size}});
  EXPECT_LE(static_cast<std::int64_t>(stream.size()), size);
  EXPECT_GE(static_cast<double>(stream.size()), 0.9 * static_cast<double>(size));
}

TEST_P(BaselineCodec, targets_out_of_reach_are_said_to_be) {
  const std::vector<Clip> clips = some_clips();
  for (const CodecTarget& target : {CodecTarget{.bytes = 100}, CodecTarget{.mean_error_cm = 1e-12}}) {
    try {
      static_cast<void>(encode(GetParam(), clips, {.target = target}));
      ADD_FAILURE() << "a target out of reach was met";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage) << error.what();
    }
  }
}

TEST_P(BaselineCodec, finer_settings_of_its_own_lower_the_error_and_cost_bytes) {
  const std::vector<Clip> clips = some_clips();
  const CodecSetting& own = find_codec(GetParam()).settings().front();
  const bool more_is_finer = own.name == "components" || own.name == "coefficients";
  double last_error = 1e30;
  std::size_t last_size = 0;
  for (const double factor : {1.0, 2.0, 4.0}) {
    const double value = more_is_finer ? std::floor(0.7 * own.initial * factor) : own.initial / factor;
    const Bytes stream = encode(GetParam(), clips, {.settings = {{std::string(own.name), value}}});
    const std::vector<Clip> decoded = open_stream(stream, "s")->decode_all();
    const double error = test::error_of(clips, decoded).mean_cm();
    EXPECT_LT(error, last_error) << own.name << " " << value;
    EXPECT_GT(stream.size(), last_size) << own.name << " " << value;
    last_error = error;
    last_size = stream.size();
  }
}

TEST_P(BaselineCodec, a_part_of_a_clip_is_that_part_of_the_whole) {
  const std::vector<Clip> clips = some_clips();
  const Bytes stream = encode(GetParam(), clips);
  const auto reader = open_stream(stream, "s");
  const Clip whole = reader->decode(1);
  EXPECT_TRUE(test::same(reader->decode(1, 7, 20, -1), slice(whole, 7, 20)));
  EXPECT_TRUE(test::same(reader->decode_all()[1], whole));
  EXPECT_THROW(static_cast<void>(reader->decode(1, whole.frames - 1, 2, -1)), Error);
}

TEST_P(BaselineCodec, streams_and_clips_are_the_same_on_one_thread) {
  const std::vector<Clip> clips = some_clips();
  const Bytes stream = encode(GetParam(), clips);
  const std::vector<Clip> decoded = open_stream(stream, "s")->decode_all();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(encode(GetParam(), clips), stream);
  const std::vector<Clip> again = open_stream(stream, "s")->decode_all();
  for (std::size_t c = 0; c < clips.size(); ++c) EXPECT_TRUE(test::same(decoded[c], again[c]));
}

TEST_P(BaselineCodec, clips_longer_than_a_piece_come_back_whole) {
  Clip clip = make_clip("long", test::sample_clips().front().skeleton, 60, 33000);
  const Clip& model = test::sample_clips().front();
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    for (int f = 0; f < clip.frames; ++f) {
      const int swing = f % (2 * model.frames - 2);
      clip.set_rotation(j, f, model.rotation(j, swing < model.frames ? swing : 2 * model.frames - 2 - swing));
    }
  }
  const Bytes stream = encode(GetParam(), std::span(&clip, 1), {.settings = {{"step", 1}}});
  const auto reader = open_stream(stream, "s");
  const Clip decoded = reader->decode(0);
  ASSERT_EQ(decoded.frames, clip.frames);
  EXPECT_LT(reader->stream().error().mean_joint_error_cm, 20);
  EXPECT_TRUE(test::same(reader->decode(0, 16000, 1000, -1), slice(decoded, 16000, 1000)));
}

INSTANTIATE_TEST_SUITE_P(Codecs, BaselineCodec, testing::Values("pca", "dwt", "awt", "fourier", "legendre"),
                         [](const auto& codec) { return std::string(codec.param); });

TEST(PcaCodec, all_components_are_lossless_but_for_the_quantiser) {
  const std::vector<Clip> clips = some_clips();
  double last = 1e30;
  for (const double step : {0.1, 0.01, 0.001}) {
    const Bytes stream = encode("pca", clips, {.settings = {{"components", 4096}, {"step", step}}});
    const double mse = compare(clips[0], open_stream(stream, "s")->decode(0)).channel_mse_deg2;
    EXPECT_LT(mse, 2 * step * step);
    EXPECT_LT(mse, last);
    last = mse;
  }
}

TEST(PcaCodec, no_components_leave_the_mean_pose) {
  const std::vector<Clip> clips = some_clips();
  const Clip still = open_stream(encode("pca", clips, {.settings = {{"components", 0}}}), "s")->decode(0);
  for (int j = 0; j < still.skeleton.joint_count(); ++j) {
    EXPECT_EQ(still.rotation(j, 0).coeffs(), still.rotation(j, still.frames - 1).coeffs());
  }
}

TEST(AwtCodec, annealing_takes_less_error_for_the_budget_than_wavelets_with_a_threshold_do_for_their_bytes) {
  const std::vector<Clip> clips = some_clips();
  const Bytes awt = encode("awt", clips, {.target = {.mean_error_cm = 0.3}});
  const Bytes dwt = encode("dwt", clips, {.target = {.mean_error_cm = 0.3}});
  EXPECT_LT(static_cast<double>(awt.size()), 1.2 * static_cast<double>(dwt.size()));
}

class RawCodecs : public testing::TestWithParam<const char*> {};

TEST_P(RawCodecs, lose_only_what_32_bit_floats_do) {
  const std::vector<Clip> clips = some_clips();
  const Bytes stream = encode(GetParam(), clips);
  const auto reader = open_stream(stream, "s");
  const std::vector<Clip> decoded = reader->decode_all();
  EXPECT_LT(test::error_of(clips, decoded).largest, 1e-4);
  EXPECT_TRUE(test::same(reader->decode(2, 3, 9, -1), slice(decoded[2], 3, 9)));
  double floats = 0;
  for (const Clip& clip : clips) {
    floats += 4.0 * clip.frames * static_cast<double>(3 + 3 * clip.skeleton.rotating_joints().size());
  }
  EXPECT_LT(static_cast<double>(stream.size()), floats);
}

TEST_P(RawCodecs, meet_targets_that_lossless_is_good_for_and_refuse_others) {
  const std::vector<Clip> clips = some_clips();
  EXPECT_FALSE(encode(GetParam(), clips, {.target = {.max_error_cm = 0.001}}).empty());
  EXPECT_THROW(static_cast<void>(encode(GetParam(), clips, {.target = {.bytes = 500}})), Error);
}

INSTANTIATE_TEST_SUITE_P(Packers, RawCodecs, testing::Values("raw+zstd", "raw+xz"),
                         [](const auto& codec) { return codec.param[4] == 'z' ? "zstd" : "xz"; });

}  // namespace
}  // namespace kinespace
