#include "kinespace/codecs/registry.h"

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/codecs/sample_stream.h"
#include "tests/support/forged_stream.h"

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

TEST(Registry, a_payload_of_a_later_version_is_refused_by_its_number) {
  for (const Codec* codec : all_codecs()) {
    const std::vector<Clip> clips{slice(test::sample_clips().front(), 0, 40)};
    const Bytes stream = encode(codec->name(), clips);
    const auto error_at = [&](std::int64_t version) {
      const Bytes told = test::with_option(stream, "payload", std::to_string(version));
      try {
        return open_stream(told, "later.ksm")->clips().size() == 1 ? std::string() : "another number of clips";
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::bad_input);
        return std::string(error.what());
      }
    };
    const int newest = codec->versions().back().number;
    EXPECT_EQ(error_at(newest), "") << codec->name();
    const std::string later = error_at(newest + 1);
    EXPECT_NE(later.find("later.ksm"), std::string::npos) << later;
    EXPECT_NE(later.find("version " + std::to_string(newest + 1)), std::string::npos) << later;
    EXPECT_NE(later.find("newer kinespace"), std::string::npos) << later;
    EXPECT_NE(error_at(0), "");
    for (std::size_t v = 0; v < codec->versions().size(); ++v) {
      EXPECT_EQ(codec->versions()[v].number, static_cast<int>(v) + 1) << "append only, one after the other";
      EXPECT_FALSE(codec->versions()[v].reason.empty());
    }
  }
}

TEST(Registry, settings_are_written_in_words_and_numbers_and_come_back) {
  for (const Codec* codec : all_codecs()) {
    for (const CodecSetting& setting : codec->settings()) {
      for (const double value : {setting.initial, setting.least, setting.most}) {
        EXPECT_TRUE(setting.allows(value));
        EXPECT_EQ(setting.parse(setting.text(value)), value) << codec->name() << " " << setting.name;
      }
      for (const char* text : {"", "x", "1e99", "nan", "1 ", "-"}) {
        EXPECT_THROW(static_cast<void>(setting.parse(text)), Error) << setting.name << " = " << text;
      }
    }
  }
  const CodecSetting& profile = find_setting(find_codec("rma"), "profile");
  EXPECT_EQ(profile.parse("paper"), 1);
  EXPECT_EQ(profile.parse("1"), 1);
  EXPECT_EQ(profile.range(), "default or paper");
  EXPECT_FALSE(profile.allows(0.5));
  EXPECT_EQ(find_setting(find_codec("qbc"), "merge").parse("off"), 0);
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
