// What a long clip costs a codec in memory: in proportion to the clip, and little more than the clip. Bytes are
// counted; what grows with the clip is told from what does not by coding a clip of twice the length.
#include <algorithm>

#include <gtest/gtest.h>

#include "codecs/registry.h"
#include "examples/sample_motions.h"
#include "tests/support/allocation_meter.h"

namespace kinespace {
namespace {

constexpr int half_frames = 40'000;

// A motion over and over.
Clip long_clip(int frames) {
  const Clip once = sample_library({.takes = 1}).front().clip;
  Clip out = make_clip("long", once.skeleton, once.rate_hz, frames);
  for (int f = 0; f < frames; ++f) {
    for (int j = 0; j < once.skeleton.joint_count(); ++j) out.set_rotation(j, f, once.rotation(j, f % once.frames));
    for (const auto& track : once.translations) {
      out.require_translation_track(track.joint).values[static_cast<std::size_t>(f)] =
          track.values[static_cast<std::size_t>(f % once.frames)];
    }
  }
  return out;
}

std::size_t bytes_of(const Clip& clip) {
  const auto frames = static_cast<std::size_t>(clip.frames);
  return sizeof(double) * clip.rotations.size() + sizeof(Eigen::Vector3d) * frames * clip.translations.size();
}

struct CodingMemory {
  Bytes stream;
  std::size_t clip = 0;
  std::size_t encoding = 0;  // beyond the clip
  std::size_t decoding = 0;  // with the clip
};

CodingMemory memory_of(std::string_view codec, int frames, const CodecOptions& options) {
  const Clip clip = long_clip(frames);
  CodingMemory out{.stream = {}, .clip = bytes_of(clip)};
  {
    const test::AllocationMeter meter;
    out.stream = encode(codec, {&clip, 1}, options);
    out.encoding = meter.peak();
  }
  const auto reader = open_stream(out.stream, "long.ksm");
  const test::AllocationMeter meter;
  EXPECT_EQ(reader->decode_all().front().frames, frames);
  out.decoding = meter.peak();
  return out;
}

// What each byte more of the clip takes.
void expect_growth(std::string_view codec, const CodecOptions& options, double encoding, double decoding) {
  const CodingMemory half = memory_of(codec, half_frames, options);
  const CodingMemory whole = memory_of(codec, 2 * half_frames, options);
  if (!test::AllocationMeter::counts()) return;
  const auto more = static_cast<double>(whole.clip - half.clip);
  const auto growth = [&](std::size_t before, std::size_t after) {
    return (static_cast<double>(after) - static_cast<double>(before)) / more;
  };
  EXPECT_LT(growth(half.encoding, whole.encoding), encoding) << codec;
  EXPECT_LT(growth(half.decoding, whole.decoding), decoding) << codec;
}

TEST(LongClipCodec, motion_space_holds_its_curves_once_beside_the_clip_and_a_decoded_clip_once) {
  expect_growth("motion-space", {}, 1.05, 1.1);
  expect_growth("motion-space", {.target = {.max_error_cm = 8}}, 1.05, 1.1);
}

}  // namespace
}  // namespace kinespace
