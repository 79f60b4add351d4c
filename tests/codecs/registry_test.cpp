#include "kinespace/codecs/registry.h"

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/codecs/sample_stream.h"

namespace kinespace {
namespace {

TEST(Registry, every_codec_is_found_by_its_name_and_settings_have_legal_values) {
  for (const Codec* codec : all_codecs()) {
    EXPECT_EQ(&find_codec(codec->name()), codec);
    for (const CodecSetting& setting : codec->settings()) {
      EXPECT_GE(setting.initial, setting.least) << setting.name;
      EXPECT_LE(setting.initial, setting.most) << setting.name;
    }
  }
  EXPECT_THROW(static_cast<void>(find_codec("nothing")), Error);
}

TEST(Registry, every_codec_brings_every_clip_back_within_a_bound_and_opens_by_itself) {
  for (const Codec* codec : all_codecs()) {
    const std::vector<Clip> clips(test::sample_clips().begin(), test::sample_clips().begin() + 3);
    const Bytes stream = encode(codec->name(), clips, {.target = {.mean_error_cm = 0.7}});
    ASSERT_TRUE(is_clip_stream(stream));
    const auto reader = open_stream(stream, "s");
    EXPECT_EQ(reader->clips().size(), clips.size());
    EXPECT_LE(test::error_of(clips, reader->decode_all()).mean_cm(), 0.7) << codec->name();
  }
}

TEST(Registry, options_out_of_range_are_named) {
  const auto refused = [](const CodecOptions& options) {
    try {
      static_cast<void>(encode("motion-space", test::sample_clips(), options));
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refused({.target = {.mean_error_cm = -1}}).find("mean_error_cm"), std::string::npos);
  EXPECT_NE(refused({.target = {.mean_error_cm = 1, .bytes = 5}}).find("2 targets"), std::string::npos);
  EXPECT_NE(refused({.settings = {{"step", 0}}}).find("step"), std::string::npos);
  EXPECT_NE(refused({.settings = {{"steep", 1}}}).find("steep"), std::string::npos);
  EXPECT_THROW(static_cast<void>(encode("motion-space", {})), Error);
}

TEST(Registry, other_bytes_are_no_stream_of_clips) {
  EXPECT_FALSE(is_clip_stream({}));
  const Bytes other = BitstreamWriter("something else").finish();
  EXPECT_FALSE(is_clip_stream(other));
  EXPECT_THROW(static_cast<void>(open_stream(other, "other")), Error);
}

}  // namespace
}  // namespace kinespace
