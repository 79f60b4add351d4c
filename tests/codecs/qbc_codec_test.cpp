// The promises of the qbc codec: its limit, joints and previews by themselves, and what it makes of recordings.
#include "kinespace/codecs/qbc/qbc_codec.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/qbc/detail/curve_choice.h"
#include "kinespace/codecs/qbc/detail/qbc_stream.h"
#include "kinespace/codecs/stream/joint_channels.h"
#include "kinespace/codecs/stream/measured_stream.h"
#include "kinespace/motion/euler.h"
#include "kinespace/motion/read.h"
#include "tests/codecs/sample_stream.h"
#include "tests/support/data.h"
#include "tests/support/forged_stream.h"

namespace kinespace {
namespace {

using test::data_folder;

constexpr double root_unit = 5.6444F;

std::unique_ptr<StreamReader> open(const Bytes& stream) {
  return open_stream(stream, "s");
}

// Of the worst joint and frame, in the units of the limit.
double largest_squared_distance(const Clip& clip, const Clip& decoded, const ChannelLayout& layout) {
  const ChannelCurves a = channel_curves(clip, layout), b = channel_curves(decoded, layout);
  double out = 0;
  for (std::size_t j = 0; j < layout.joints.size(); ++j) {
    for (std::size_t f = 0; f < static_cast<std::size_t>(clip.frames); ++f) {
      double sum = 0;
      const auto add = [&](int c, double unit) {
        double off = (a.channel(c)[f] - b.channel(c)[f]) / unit;
        if (c > 2) off -= 360 * std::nearbyint(off / 360);
        sum += off * off;
      };
      for (int c = 0; j == 0 && c < 3; ++c) add(c, root_unit);
      for (int t = 0; t < layout.joints[j].turns; ++t) add(layout.joints[j].first_channel + t, 1);
      out = std::max(out, sum);
    }
  }
  return out;
}

TEST(Qbc, no_frame_of_any_joint_passes_the_limit) {
  for (const Clip& clip : std::span(test::sample_clips()).first(5)) {
    const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
    for (const double limit : {0.3, 4.0, 60.0}) {
      for (const double merge : {0.0, 1.0}) {
        const Bytes stream =
            encode("qbc", std::span(&clip, 1), {.settings = {{"max_squared_distance", limit}, {"merge", merge}}});
        const Clip decoded = open(stream)->decode(0, -1);
        EXPECT_LE(largest_squared_distance(clip, decoded, layout), limit * (1 + 1e-6)) << clip.name << " " << merge;
      }
    }
  }
}

TEST(Qbc, a_joint_decoded_alone_is_the_joint_of_the_whole) {
  const std::span<const Clip> clips = std::span(test::sample_clips()).first(3);
  const Bytes stream = encode("qbc", clips);
  const auto reader = open(stream);
  ASSERT_TRUE(reader->decodes_joints());
  for (std::size_t c = 0; c < clips.size(); ++c) {
    const Clip whole = reader->decode(c, -1);
    for (int j = 0; j < whole.skeleton.joint_count(); ++j) {
      const Clip alone = reader->decode_joint(c, j, 7, 30);
      for (int f = 0; f < 30; ++f) {
        EXPECT_EQ(alone.rotation(j, f).coeffs(), whole.rotation(j, 7 + f).coeffs()) << j << " " << f;
        if (j > 0) continue;
        EXPECT_EQ(alone.translation(j, f), whole.translation(j, 7 + f));
      }
    }
  }
  EXPECT_THROW(static_cast<void>(reader->decode_joint(0, 999, 0, 1)), Error);
  EXPECT_THROW(static_cast<void>(reader->decode_joint(0, 1, 0, 100000)), Error);
}

// The stream of one clip with the bytes of all other joints spoilt, under checksums that fit.
Bytes spoilt_but_for(const Bytes& stream, std::size_t kept) {
  const Bitstream parsed = Bitstream::parse(stream, "s");
  const auto table_bytes = parsed.section("clips");
  const ClipTable table = unpack_clip_table(table_bytes, most_frames(stream.size()), "s");
  const auto section = parsed.section("curves");
  const QbcCurves curves = unpack_curves(section, table, "s");
  Bytes changed(section.begin(), section.end());
  for (std::size_t j = 0; j < curves.curves.size(); ++j) {
    if (j == kept) continue;
    const auto code = curves.curves[j].code;
    for (std::size_t i = 0; i < code.size(); ++i) {
      changed[static_cast<std::size_t>(code.data() - section.data()) + i] ^= std::byte{0x5a};
    }
  }
  BitstreamWriter out(parsed.kind());
  out.add_section("clips", Bytes(table_bytes.begin(), table_bytes.end()));
  out.add_section("curves", changed);
  return out.finish();
}

TEST(Qbc, one_joint_needs_no_byte_of_the_others) {
  const Clip& clip = test::sample_clips()[2];
  const Bytes stream = encode("qbc", std::span(&clip, 1));
  const Clip whole = open(stream)->decode(0, -1);
  const std::vector<int> joints = clip.skeleton.rotating_joints();
  for (const std::size_t j : {std::size_t{0}, std::size_t{3}, joints.size() - 1}) {
    const Bytes spoilt = spoilt_but_for(stream, j);
    const Clip alone = open(spoilt)->decode_joint(0, joints[j], 0, clip.frames);
    for (int f = 0; f < clip.frames; ++f) {
      EXPECT_EQ(alone.rotation(joints[j], f).coeffs(), whole.rotation(joints[j], f).coeffs());
    }
  }
}

TEST(Qbc, the_preview_is_the_clip_at_the_common_breaks) {
  const Clip& clip = test::sample_clips()[1];
  const Bytes stream = encode("qbc", std::span(&clip, 1), {.settings = {{"interval", 16}}});
  const auto reader = open(stream);
  const std::vector<int> frames = reader->preview_frames(0);
  const Clip preview = reader->decode_preview(0);
  const Clip whole = reader->decode(0, -1);
  ASSERT_EQ(preview.frames, static_cast<int>(frames.size()));
  EXPECT_EQ(frames.front(), 0);
  EXPECT_EQ(frames.back(), clip.frames - 1);
  EXPECT_DOUBLE_EQ(preview.rate_hz, clip.rate_hz / 16);
  for (int i = 0; i < preview.frames; ++i) {
    const int f = frames[static_cast<std::size_t>(i)];
    EXPECT_TRUE(f == 16 * i || i + 1 == preview.frames) << f;
    for (int j = 0; j < whole.skeleton.joint_count(); ++j) {
      EXPECT_LT(preview.rotation(j, i).angularDistance(whole.rotation(j, f)), 1e-9);
    }
    EXPECT_LT((preview.translation(0, i) - whole.translation(0, f)).norm(), 1e-9);
  }
}

// A walk that leans over until the middle angle of the root's Z X Y passes 90 degrees.
Clip walk_through_a_pole() {
  Clip out = test::sample_clips()[0];
  for (int f = 0; f < out.frames; ++f) {
    const double lean = (44 + 100.0 * f / (out.frames - 1)) * std::numbers::pi / 180;
    out.set_rotation(0, f, Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitX()) * out.rotation(0, f));
  }
  return out;
}

// Of a frame's angles of the root as a file tells them.
double file_error(const Clip& clip, const Clip& decoded, int frame) {
  const EulerOrder order = euler_order(clip.skeleton.joints[0].channels);
  const EulerAngles a = euler_angles(order, clip.rotation(0, frame));
  const EulerAngles b = euler_angles(order, decoded.rotation(0, frame), a);
  return std::pow(a[0] - b[0], 2) + std::pow(a[1] - b[1], 2) + std::pow(a[2] - b[2], 2);
}

TEST(Qbc, the_roots_file_angles_stay_near_at_their_poles) {
  const Clip clip = walk_through_a_pole();
  for (const double limit : {0.5, 4.0, 18.0, 100.0}) {
    const Bytes stream = encode("qbc", std::span(&clip, 1), {.settings = {{"max_squared_distance", limit}}});
    const auto reader = open(stream);
    const Clip decoded = reader->decode(0, -1);
    const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
    EXPECT_LE(largest_squared_distance(clip, decoded, layout), limit * (1 + 1e-6));
    double largest = 0;
    for (int f = 0; f < clip.frames; ++f) largest = std::max(largest, file_error(clip, decoded, f));
    EXPECT_LE(largest, 2.5 * limit) << limit;
  }
}

TEST(Qbc, previews_and_parts_have_the_corrections_of_the_whole) {
  const Clip clip = walk_through_a_pole();
  const Bytes stream = encode("qbc", std::span(&clip, 1), {.settings = {{"max_squared_distance", 8}, {"interval", 1}}});
  const auto reader = open(stream);
  const Clip whole = reader->decode(0, -1);
  const Clip preview = reader->decode_preview(0);
  ASSERT_EQ(preview.frames, clip.frames);
  for (int f = 0; f < clip.frames; ++f) {
    EXPECT_LT(preview.rotation(0, f).angularDistance(whole.rotation(0, f)), 1e-9) << f;
    EXPECT_TRUE(test::same(reader->decode(0, f, 1, -1), slice(whole, f, 1))) << f;
  }
}

TEST(Qbc, damaged_curves_with_corrections_are_errors_or_clips) {
  const Clip clip = slice(walk_through_a_pole(), 40, 70);
  const Bytes stream = encode("qbc", std::span(&clip, 1), {.settings = {{"max_squared_distance", 4}}});
  const Bytes whole = test::part(stream, "curves");
  int errors = 0;
  for (std::size_t n = 0; n < whole.size(); ++n) {
    for (const auto mask : {std::byte{0x01}, std::byte{0x80}, std::byte{0xff}}) {
      Bytes changed = whole;
      changed[n] ^= mask;
      try {
        const Bytes forged = test::forged(stream, "curves", changed);
        const Clip decoded = open(forged)->decode(0, -1);
        for (const double q : decoded.rotations) ASSERT_TRUE(std::isfinite(q)) << n;
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
        ++errors;
      }
    }
  }
  EXPECT_GT(errors, 100);
}

TEST(Qbc, parts_of_a_clip_equal_the_whole) {
  const Clip& clip = test::sample_clips()[0];
  const Bytes stream = encode("qbc", std::span(&clip, 1));
  const auto reader = open(stream);
  const Clip whole = reader->decode(0, -1);
  for (const int first : {0, 1, 17, clip.frames - 20}) {
    const Clip part = reader->decode(0, first, 20, -1);
    EXPECT_TRUE(test::same(part, slice(whole, first, 20))) << first;
  }
}

TEST(Qbc, targets_are_met_and_stated) {
  const std::vector<Clip> short_clips{slice(test::sample_clips()[0], 0, 60), slice(test::sample_clips()[4], 10, 50)};
  const std::span<const Clip> clips = short_clips;
  for (const double target : {0.4, 2.0}) {
    const Bytes stream = encode("qbc", clips, {.target = {.mean_error_cm = target}});
    const double mean = test::error_of({clips.begin(), clips.end()}, open(stream)->decode_all()).mean_cm();
    EXPECT_LE(mean, target);
    EXPECT_GT(mean, 0.75 * target);
    EXPECT_NEAR(open(stream)->stream().error().mean_joint_error_cm, mean, 1e-5);
  }
  const Bytes stream = encode("qbc", clips, {.target = {.max_error_cm = 3}});
  EXPECT_LE(test::error_of({clips.begin(), clips.end()}, open(stream)->decode_all()).largest, 3);
  EXPECT_LE(encode("qbc", clips, {.target = {.bytes = 2400}}).size(), 2400U);
}

TEST(Qbc, targets_that_cannot_be_met_are_usage_errors) {
  const Clip clip = slice(test::sample_clips()[0], 0, 30);
  const std::span<const Clip> clips(&clip, 1);
  for (const CodecTarget& target : {CodecTarget{.bytes = 60}, CodecTarget{.max_error_cm = 1e-12}}) {
    try {
      static_cast<void>(encode("qbc", clips, {.target = target}));
      ADD_FAILURE() << "met";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
    }
  }
}

TEST(Qbc, a_long_clip_is_coded_and_parts_of_it_decode) {
  const Clip& walk = test::sample_clips()[0];
  constexpr int frames = 100000;
  Clip clip = make_clip("long", walk.skeleton, walk.rate_hz, frames);
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    // There and back, so that there is no jump.
    const int period = 2 * walk.frames - 2;
    for (int f = 0; f < frames; ++f) {
      const int at = f % period;
      clip.set_rotation(j, f, walk.rotation(j, at < walk.frames ? at : period - at));
    }
  }
  const Bytes stream = encode("qbc", std::span(&clip, 1), {.settings = {{"merge", 0}}});
  const Clip part = open(stream)->decode(0, 99900, 100, -1);
  EXPECT_LT(clip_error(clip, part, 99900, 100, 0).mean_cm(), 10);
}

TEST(Qbc, recordings_of_a_walk_take_a_sixtieth_of_their_text) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const auto path = data / "cmu" / "02" / "02_01.amc";
  const Clip clip = read_clip(path);
  const Bytes stream = encode("qbc", std::span(&clip, 1));
  const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
  EXPECT_LE(largest_squared_distance(clip, open(stream)->decode(0, -1), layout), 18 * (1 + 1e-6));
  EXPECT_GT(static_cast<double>(std::filesystem::file_size(path)) / static_cast<double>(stream.size()), 120);
}

TEST(Qbc, a_climb_whose_root_passes_a_pole_spends_no_error_there) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const Clip clip = read_clip(data / "cmu" / "01" / "01_01.amc");
  const Bytes stream = encode("qbc", std::span(&clip, 1));
  const Clip decoded = open(stream)->decode(0, -1);
  double sum = 0;
  for (int f = 0; f < clip.frames; ++f) sum += file_error(clip, decoded, f);
  EXPECT_LT(sum / clip.frames, 0.6);  // 4 when the frames at the pole are as all others
}

}  // namespace
}  // namespace kinespace
