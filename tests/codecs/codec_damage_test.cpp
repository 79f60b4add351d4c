// What every codec owes the one who opens a stream: clips, or an error that names the file, for any bytes at all.
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/codecs/sample_stream.h"
#include "tests/codecs/toy_codec.h"
#include "tests/support/allocation_meter.h"
#include "tests/support/forged_stream.h"

namespace kinespace {
namespace {

constexpr std::size_t base_memory = std::size_t{64} << 20;
constexpr std::size_t memory_a_byte = 16;

// As open_stream does, by a codec that need not be registered.
std::unique_ptr<StreamReader> open(const Codec& codec, std::span<const std::byte> bytes, std::string source) {
  return codec.open(Bitstream::parse_prefix(bytes, std::move(source)));
}

// True when the bytes gave clips. No more memory than the stream's size allows, clips handed out not counted.
bool decodes(const Codec& codec, std::span<const std::byte> bytes) {
  const test::AllocationMeter meter;
  bool good = false;
  std::size_t clip_bytes = 0;
  try {
    const auto reader = open(codec, bytes, "damaged.ksm");
    for (std::size_t c = 0; c < reader->clips().size(); c += 2) {
      const Clip clip = reader->decode(c);
      EXPECT_EQ(clip.frames, reader->clips()[c].frames);
      for (const double q : clip.rotations) EXPECT_TRUE(std::isfinite(q));
      clip_bytes = std::max(clip_bytes, clip.rotations.size() * sizeof(double));
    }
    good = true;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
    EXPECT_NE(std::string(error.what()).find("damaged.ksm"), std::string::npos) << error.what();
  }
  EXPECT_LE(meter.peak(), memory_a_byte * bytes.size() + base_memory + 2 * clip_bytes);
  return good;
}

class CodecDamage : public testing::TestWithParam<const Codec*> {
 protected:
  [[nodiscard]] static bool decodes(std::span<const std::byte> bytes) { return kinespace::decodes(*GetParam(), bytes); }
  // Four short clips with the codec's own settings, made once.
  [[nodiscard]] const Bytes& stream() const {
    static std::map<std::string, Bytes, std::less<>> streams;
    const std::string name(GetParam()->name());
    const auto found = streams.find(name);
    if (found != streams.end()) return found->second;
    std::vector<Clip> clips;
    for (std::size_t c = 0; c < 4; ++c) {
      const Clip& clip = test::sample_clips()[c];
      clips.push_back(slice(clip, 0, std::min(clip.frames, 60)));
    }
    return streams.emplace(name, encode(*GetParam(), clips)).first->second;
  }
};

TEST_P(CodecDamage, every_prefix_is_a_coarser_stream_or_an_error) {
  const std::size_t stride = 1 + stream().size() / 150;
  for (std::size_t n = 0; n < stream().size(); n += n < 64 ? 1 : stride) {
    const bool good = decodes(std::span(stream()).first(n));
    if (good) {
      EXPECT_GT(open(*GetParam(), stream(), "s")->levels(), 1) << "a codec without levels took a prefix of " << n;
    }
  }
}

TEST_P(CodecDamage, every_flipped_byte_is_noticed) {
  Bytes changed = stream();
  const std::size_t stride = 1 + changed.size() / 150;
  for (std::size_t n = 0; n < changed.size(); n += n < 64 ? 1 : stride) {
    changed[n] ^= std::byte{0x04};
    EXPECT_FALSE(decodes(changed)) << n;
    changed[n] ^= std::byte{0x04};
  }
}

TEST_P(CodecDamage, extra_bytes_are_refused) {
  Bytes longer = stream();
  longer.push_back(std::byte{0});
  EXPECT_FALSE(decodes(longer));
}

TEST_P(CodecDamage, forged_parts_with_fitting_checksums_are_errors_or_clips) {
  ASSERT_TRUE(decodes(test::forged(stream(), "", {})));
  int errors = 0;
  for (const std::string& name : test::parts_of(stream())) {
    const Bytes whole = test::part(stream(), name);
    for (std::size_t n = 0; n < whole.size(); n += 1 + whole.size() / 40) {
      for (const auto mask : {std::byte{0x21}, std::byte{0x80}, std::byte{0xff}}) {
        Bytes changed = whole;
        changed[n] ^= mask;
        errors += decodes(test::forged(stream(), name, changed)) ? 0 : 1;
      }
      Bytes shorter = whole;
      shorter.resize(n);
      errors += decodes(test::forged(stream(), name, shorter)) ? 0 : 1;
    }
    if (!whole.empty()) {
      EXPECT_FALSE(decodes(test::forged(stream(), name, {}))) << name;
    }
    // Varints of the largest counts, wherever the part begins with one.
    errors += decodes(test::forged(stream(), name, Bytes(64, std::byte{0xff}))) ? 0 : 1;
  }
  EXPECT_GT(errors, 10);
}

TEST_P(CodecDamage, targets_that_cannot_be_met_are_refused) {
  const Clip clip = slice(test::sample_clips().front(), 0, 30);
  try {
    static_cast<void>(encode(*GetParam(), std::span(&clip, 1), {.target = {.bytes = 60}}));
    ADD_FAILURE() << "a clip in 60 bytes";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage) << error.what();
  }
}

TEST_P(CodecDamage, clips_that_are_no_motion_are_refused_by_joint_and_frame) {
  const Clip sound = slice(test::sample_clips().front(), 0, 30);
  Clip turned = sound, moved = sound;
  turned.rotation_track(3)[4 * 17] = std::numeric_limits<double>::quiet_NaN();
  moved.require_translation_track(0).values[5].y() = std::numeric_limits<double>::infinity();
  for (const auto& [clip, joint, frame] : {std::tuple{&turned, 3, "frame 18"}, {&moved, 0, "frame 6"}}) {
    try {
      static_cast<void>(encode(*GetParam(), std::span(clip, 1)));
      ADD_FAILURE() << "what is no number was encoded";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
      const std::string& name = sound.skeleton.joints[static_cast<std::size_t>(joint)].name;
      EXPECT_NE(std::string(error.what()).find(name + " in " + frame), std::string::npos) << error.what();
    }
  }
}

TEST_P(CodecDamage, clips_of_one_frame_and_of_ten_are_clips) {
  for (const int frames : {1, 2, 3, 10}) {
    const Clip clip = slice(test::sample_clips()[1], 5, frames);
    const Bytes bytes = encode(*GetParam(), std::span(&clip, 1));
    const Clip decoded = open(*GetParam(), bytes, "s")->decode(0);
    ASSERT_EQ(decoded.frames, frames);
    EXPECT_EQ(decoded.name, clip.name);
    EXPECT_LT(clip_error(clip, decoded, 0, frames, 0).mean_cm(), 5) << frames;
  }
}

TEST_P(CodecDamage, targets_are_met_on_the_decoded_clips) {
  std::vector<Clip> clips;
  for (std::size_t c = 0; c < 3; ++c) clips.push_back(slice(test::sample_clips()[c], 0, 60));
  const Bytes plain = encode(*GetParam(), clips, {.target = {.mean_error_cm = 1}});
  for (const CodecTarget& target : {CodecTarget{.mean_error_cm = 1.5}, CodecTarget{.max_error_cm = 4},
                                    CodecTarget{.bytes = static_cast<std::int64_t>(plain.size() * 11 / 10)}}) {
    const Bytes bytes = encode(*GetParam(), clips, {.target = target});
    const std::vector<Clip> decoded = open(*GetParam(), bytes, "s")->decode_all();
    ClipErrorSums error;
    for (std::size_t c = 0; c < clips.size(); ++c) error.add(clip_error(clips[c], decoded[c], 0, clips[c].frames, 0));
    if (target.mean_error_cm) {
      EXPECT_LE(error.mean_cm(), *target.mean_error_cm);
    }
    if (target.max_error_cm) {
      EXPECT_LE(error.largest, *target.max_error_cm);
    }
    if (target.bytes) {
      EXPECT_LE(static_cast<std::int64_t>(bytes.size()), *target.bytes);
    }
    EXPECT_NEAR(open(*GetParam(), bytes, "s")->stream().error().mean_joint_error_cm, error.mean_cm(), 1e-4);
  }
}

// A hip, a trunk and an arm that swing on and on, never twice alike.
Clip long_clip(int frames) {
  Skeleton skeleton;
  const std::vector<Channel> turns{Channel::z_rotation, Channel::x_rotation, Channel::y_rotation};
  std::vector<Channel> root{Channel::x_position, Channel::y_position, Channel::z_position};
  root.insert(root.end(), turns.begin(), turns.end());
  skeleton.joints = {{.name = "Hips", .parent = -1, .offset = {0, 90, 0}, .channels = root},
                     {.name = "Spine", .parent = 0, .offset = {0, 40, 0}, .channels = turns},
                     {.name = "Arm", .parent = 1, .offset = {20, 0, 0}, .channels = turns, .end_site = {{30, 0, 0}}}};
  Clip clip = make_clip("long", skeleton, 120, frames);
  auto& travel = clip.require_translation_track(0).values;
  for (int f = 0; f < frames; ++f) {
    const double t = f / 120.0;
    travel[static_cast<std::size_t>(f)] = {300 * std::sin(0.05 * t), 90 + 2 * std::sin(7 * t),
                                           200 * std::cos(0.03 * t)};
    for (int j = 0; j < 3; ++j) {
      const double angle = (0.2 + 0.2 * j) * std::sin((1.3 + 0.4 * j + 0.001 * t) * t) + 0.1 * std::sin(0.7 * t);
      clip.set_rotation(j, f,
                        Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 0.3 * j, 0.2).normalized())));
    }
  }
  return clip;
}

TEST_P(CodecDamage, a_clip_of_a_hundred_thousand_frames_comes_back_whole_and_in_parts) {
  const Clip clip = long_clip(100'000);
  const Bytes bytes = encode(*GetParam(), std::span(&clip, 1));
  EXPECT_LT(bytes.size(), clip.rotations.size() * sizeof(float));
  const auto reader = open(*GetParam(), bytes, "s");
  const Clip decoded = reader->decode(0);
  ASSERT_EQ(decoded.frames, clip.frames);
  const ClipErrorSums error = clip_error(clip, decoded, 0, clip.frames, 0);
  EXPECT_LE(error.mean_cm(), reader->stream().error().mean_joint_error_cm * (1 + 1e-6));
  const Clip part = reader->decode(0, 77'000, 50, -1);
  EXPECT_EQ(part.rotation(2, 49).coeffs(), decoded.rotation(2, 77'049).coeffs());
}

// Those of the registry, and one that is nowhere else.
std::vector<const Codec*> codecs_and_a_toy() {
  static const test::ToyCodec toy;
  std::vector<const Codec*> out(all_codecs().begin(), all_codecs().end());
  out.push_back(&toy);
  return out;
}

INSTANTIATE_TEST_SUITE_P(Codecs, CodecDamage, testing::ValuesIn(codecs_and_a_toy()), [](const auto& codec) {
  std::string name(codec.param->name());
  for (char& c : name) {
    if (c == '-' || c == '+') c = '_';
  }
  return name;
});

}  // namespace
}  // namespace kinespace
