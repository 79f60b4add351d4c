// What a long clip costs a codec in memory: in proportion to the clip, and little more than the clip. Bytes are
// counted; what grows with the clip is told from what does not by coding a clip of twice the length.
#include <functional>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "examples/sample_motions.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/codecs/rma/contact_trajectories.h"
#include "kinespace/codecs/rma/markers.h"
#include "tests/support/allocation_meter.h"
#include "tests/support/long_clip.h"

namespace kinespace {
namespace {

constexpr int half_frames = 40'000;

Clip repeated_motion(int frames) {
  return test::over_and_over(sample_library({.takes = 1}).front().clip, frames);
}

std::size_t bytes_of(const Clip& clip) {
  const auto frames = static_cast<std::size_t>(clip.frames);
  return sizeof(double) * clip.rotations.size() + sizeof(Eigen::Vector3d) * frames * clip.translations.size();
}

// What each byte more of a clip takes: `peak_of` is what work on a clip of so many frames takes at most.
double growth(const std::function<std::size_t(const Clip&)>& peak_of) {
  // What each thread holds of the clip is another matter.
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 2);
  const Clip half = repeated_motion(half_frames);
  const Clip whole = repeated_motion(2 * half_frames);
  const auto before = static_cast<double>(peak_of(half));
  const auto after = static_cast<double>(peak_of(whole));
  return (after - before) / static_cast<double>(bytes_of(whole) - bytes_of(half));
}

// The most that is held while `work` is done, beyond what was held before.
std::size_t peak_of(const std::function<void()>& work) {
  const test::AllocationMeter meter;
  work();
  return meter.peak();
}

std::size_t encoding_peak(const Clip& clip, const CodecOptions& options) {
  return peak_of([&] { static_cast<void>(encode("motion-space", {&clip, 1}, options)); });
}

TEST(LongClipCodec, motion_space_holds_its_curves_once_beside_the_clip) {
  if (!test::AllocationMeter::counts()) return;
  EXPECT_LT(growth([](const Clip& clip) { return encoding_peak(clip, {}); }), 1.05);
  EXPECT_LT(growth([](const Clip& clip) { return encoding_peak(clip, {.target = {.max_error_cm = 8}}); }), 1.05);
}

TEST(LongClipCodec, motion_space_is_decoded_into_the_clip_itself) {
  if (!test::AllocationMeter::counts()) return;
  const auto decoding = [](const Clip& clip) {
    const Bytes stream = encode("motion-space", {&clip, 1}, {});
    return peak_of([&] { static_cast<void>(open_stream(stream, "long.ksm")->decode_all()); });
  };
  EXPECT_LT(growth(decoding), 1.1);
}

TEST(LongClipCodec, contacts_are_found_without_the_positions_of_all_joints) {
  if (!test::AllocationMeter::counts()) return;
  EXPECT_LT(growth([](const Clip& clip) { return peak_of([&] { static_cast<void>(find_contacts(clip)); }); }), 0.65);
}

TEST(LongClipCodec, markers_are_doubles_for_some_frames_at_a_time_only) {
  if (!test::AllocationMeter::counts()) return;
  const auto making = [](const Clip& clip) { return peak_of([&] { static_cast<void>(marker_table({&clip, 1})); }); };
  EXPECT_LT(growth(making), 2);
}

}  // namespace
}  // namespace kinespace
