// The RMA codec and clip-pca whole: targets, profiles, hard motions, both kept against each other.
#include "kinespace/codecs/rma/rma_codec.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/read.h"
#include "tests/codecs/sample_stream.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::data_folder;
using Settings = std::map<std::string, double, std::less<>>;

struct Way {
  const char* codec;
  Settings settings;
};

// Both profiles, and clip-pca.
const std::vector<Way>& ways() {
  static const std::vector<Way> all{{"rma", {{"profile", 0}}}, {"rma", {{"profile", 1}}}, {"clip-pca", {}}};
  return all;
}

std::vector<Clip> rma_clips() {
  return {test::sample_clips().begin(), test::sample_clips().begin() + 4};
}

TEST(RmaCodec, errors_are_met_measured_and_written_down) {
  const std::vector<Clip> clips = rma_clips();
  for (const Way& way : ways()) {
    for (const double target : {3.0, 1.0}) {
      const Bytes stream = encode(way.codec, clips, {.target = {.mean_error_cm = target}, .settings = way.settings});
      const auto reader = open_stream(stream, "s");
      const ClipErrorSums error = test::error_of(clips, reader->decode_all());
      EXPECT_LE(error.mean_cm(), target) << way.codec;
      EXPECT_NEAR(reader->stream().error().mean_joint_error_cm, error.mean_cm(), 1e-4) << way.codec;
    }
  }
}

TEST(RmaCodec, largest_errors_and_sizes_are_met) {
  const std::vector<Clip> clips = rma_clips();
  for (const Way& way : ways()) {
    const Bytes near = encode(way.codec, clips, {.target = {.max_error_cm = 6}, .settings = way.settings});
    EXPECT_LE(test::error_of(clips, open_stream(near, "s")->decode_all()).largest, 6) << way.codec;
    const auto bytes = static_cast<std::int64_t>(near.size()) * 8 / 10;
    EXPECT_LE(encode(way.codec, clips, {.target = {.bytes = bytes}, .settings = way.settings}).size(), bytes);
    EXPECT_THROW(static_cast<void>(encode(way.codec, clips, {.target = {.bytes = 60}, .settings = way.settings})),
                 Error);
  }
}

TEST(RmaCodec, names_rates_skeletons_and_ranges_come_back_the_same_on_any_number_of_threads) {
  const std::vector<Clip> clips = rma_clips();
  for (const Way& way : ways()) {
    const Bytes stream = encode(way.codec, clips, {.settings = way.settings});
    const auto reader = open_stream(stream, "s");
    const std::vector<Clip> all = reader->decode_all();
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(encode(way.codec, clips, {.settings = way.settings}), stream) << way.codec;
    for (std::size_t c = 0; c < clips.size(); ++c) {
      EXPECT_EQ(all[c].name, clips[c].name);
      EXPECT_EQ(all[c].rate_hz, clips[c].rate_hz);
      EXPECT_TRUE(all[c].skeleton.same_tree(clips[c].skeleton));
      EXPECT_TRUE(test::same(reader->decode(c), all[c])) << way.codec;
      const Clip part = reader->decode(c, 7, 20, -1);
      EXPECT_TRUE(test::same(part, slice(all[c], 7, 20))) << way.codec;
    }
    EXPECT_THROW(static_cast<void>(reader->decode(0, 0, clips[0].frames + 1, -1)), Error);
  }
}

// A motion of one walk after another.
Clip repeated(const Clip& clip, int times) {
  Clip out = make_clip("again and again", clip.skeleton, clip.rate_hz, clip.frames * times);
  const int root = clip.skeleton.travel_root();
  auto& travel = out.require_translation_track(root).values;
  for (int f = 0; f < out.frames; ++f) {
    for (int j = 0; j < clip.skeleton.joint_count(); ++j) out.set_rotation(j, f, clip.rotation(j, f % clip.frames));
    travel[static_cast<std::size_t>(f)] = clip.translation(root, f % clip.frames);
  }
  return out;
}

double mean_error(const Clip& clip, const Way& way, double target) {
  const Bytes stream =
      encode(way.codec, std::span(&clip, 1), {.target = {.mean_error_cm = target}, .settings = way.settings});
  const Clip decoded = open_stream(stream, "s")->decode(0);
  EXPECT_EQ(decoded.frames, clip.frames);
  return clip_error(clip, decoded, 0, clip.frames, 0).mean_cm();
}

TEST(RmaCodec, one_cycle_a_thousand_times_takes_few_bytes_and_repeats_pay) {
  const Clip& walk = test::sample_clips().front();
  const Clip cycle = slice(walk, 0, std::min(walk.frames, 15));
  const Clip thousand = repeated(cycle, 1000);
  EXPECT_LE(mean_error(thousand, ways()[0], 2), 2);
  EXPECT_LE(mean_error(thousand, ways()[2], 2), 2);
  const Clip clip = repeated(slice(walk, 0, std::min(walk.frames, 40)), 60);
  const auto size = [&](double repeats) {
    return encode("rma", std::span(&clip, 1),
                  {.target = {.mean_error_cm = 1}, .settings = {{"profile", 1}, {"repeats", repeats}, {"contacts", 0}}})
        .size();
  };
  EXPECT_LT(static_cast<double>(size(1)), 0.8 * static_cast<double>(size(0)));
}

TEST(RmaCodec, the_default_profile_never_loses_to_every_clip_unique) {
  const std::vector<Clip> clips = rma_clips();
  for (const double target : {2.0, 0.5}) {
    const auto size = [&](double repeats) {
      return encode("rma", clips, {.target = {.mean_error_cm = target}, .settings = {{"repeats", repeats}}}).size();
    };
    EXPECT_LE(size(1), size(0));
  }
}

TEST(RmaCodec, held_poses_seconds_and_motion_without_repetition_are_coded) {
  const Clip& walk = test::sample_clips().front();
  Clip held = make_clip("held", walk.skeleton, 120, 1000);
  Clip wandering = make_clip("no way twice", walk.skeleton, 30, 400);
  const int root = walk.skeleton.travel_root();
  for (int j = 0; j < walk.skeleton.joint_count(); ++j) {
    for (int f = 0; f < held.frames; ++f) held.set_rotation(j, f, walk.rotation(j, 3));
    if (!walk.skeleton.joints[static_cast<std::size_t>(j)].has_rotation()) continue;
    for (int f = 0; f < wandering.frames; ++f) {
      const double angle = 0.004 * f * std::sin(1.3 * j) + 0.3 * std::sin(0.0003 * f * f + j);
      wandering.set_rotation(j, f, Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX())));
    }
  }
  wandering.require_translation_track(root);
  const Clip second = slice(walk, 0, std::min(walk.frames, 30));
  for (const Way& way : ways()) {
    EXPECT_LE(mean_error(held, way, 0.5), 0.5) << way.codec;
    EXPECT_LE(mean_error(wandering, way, 1.5), 1.5) << way.codec;
    EXPECT_LE(mean_error(second, way, 1), 1) << way.codec;
  }
}

TEST(RmaCodec, a_very_long_clip_is_coded_whole) {
  const Clip& walk = test::sample_clips().front();
  const Clip clip = repeated(walk, 100000 / walk.frames + 1);
  ASSERT_GE(clip.frames, 100000);
  const Bytes stream = encode("rma", std::span(&clip, 1), {});
  const Clip decoded = open_stream(stream, "s")->decode(0);
  ASSERT_EQ(decoded.frames, clip.frames);
  EXPECT_LT(clip_error(clip, decoded, 0, clip.frames, 0).mean_cm(), 5);
}

TEST(RmaCodec, seams_are_told_for_both_profiles) {
  const std::vector<Clip> clips = rma_clips();
  for (const double profile : {0.0, 1.0}) {
    const Bytes stream = encode("rma", clips, {.settings = {{"profile", profile}}});
    const auto seams = rma_seams(stream, "s");
    ASSERT_EQ(seams.size(), clips.size());
    for (std::size_t c = 0; c < clips.size(); ++c) {
      EXPECT_TRUE(std::ranges::is_sorted(seams[c]));
      for (const int f : seams[c]) EXPECT_TRUE(f > 0 && f < clips[c].frames);
    }
  }
}

TEST(RmaCodec, forged_parts_of_the_papers_profile_are_errors_or_clips) {
  std::vector<Clip> clips = rma_clips();
  for (Clip& clip : clips) clip = slice(clip, 0, std::min(clip.frames, 60));
  const Bytes stream = encode("rma", clips, {.settings = {{"profile", 1}}});
  const Bitstream parts = Bitstream::parse(stream, "s");
  int errors = 0;
  for (const std::string& changed : parts.section_names()) {
    const std::size_t size = parts.section(changed).size();
    for (std::size_t n = 0; n < size; n += 1 + size / 60) {
      BitstreamWriter out(parts.kind());
      out.set_option("profile", "paper");
      for (const std::string& name : parts.section_names()) {
        const auto bytes = parts.section(name);
        Bytes content(bytes.begin(), bytes.end());
        if (name == changed) content[n] ^= std::byte{0x51};
        out.add_section(name, std::move(content));
      }
      const Bytes forged = out.finish();
      try {
        const auto reader = open_stream(forged, "damaged.ksm");
        for (std::size_t c = 0; c < reader->clips().size(); ++c) static_cast<void>(reader->decode(c));
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
        ++errors;
      }
    }
  }
  EXPECT_GT(errors, 20);
}

std::vector<Clip> read_subject(const std::filesystem::path& folder, std::size_t most) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (is_motion_file(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::vector<Clip> out;
  for (std::size_t i = 0; i < files.size() && i < most; ++i) out.push_back(read_clip(files[i]));
  return out;
}

double ratio(const std::vector<Clip>& clips, const Way& way, double target) {
  const Bytes stream = encode(way.codec, clips, {.target = {.mean_error_cm = target}, .settings = way.settings});
  double raw = 0;
  for (const Clip& clip : clips) {
    raw += 4.0 * clip.frames * (3.0 + 3.0 * static_cast<double>(clip.skeleton.rotating_joints().size()));
  }
  return raw / static_cast<double>(stream.size());
}

TEST(RmaCodec, ratios_on_recordings_do_not_get_worse) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const std::vector<Clip> clips = read_subject(data / "cmu" / "02", 100);
  EXPECT_GE(ratio(clips, ways()[0], 2.4), 450);
  const double paper = ratio(clips, ways()[1], 2.4);
  EXPECT_GE(paper, 160);
  const double clip_pca = ratio(clips, ways()[2], 2.4);
  EXPECT_GE(clip_pca, 60);
  EXPECT_LT(clip_pca, paper);
}

TEST(RmaCodec, hanging_upside_down_keeps_to_its_error) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const Clip clip = read_clip(data / "cmu" / "01" / "01_13.amc");
  for (const Way& way : ways()) EXPECT_LE(mean_error(clip, way, 2.4), 2.4) << way.codec;
}

}  // namespace
}  // namespace kinespace
