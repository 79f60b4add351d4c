// The motion-space codec on recordings: bytes and errors that must not get worse.
#include <filesystem>

#include <gtest/gtest.h>

#include "kinespace/motion/read.h"
#include "tests/codecs/sample_stream.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::data_folder;

std::vector<Clip> read_some(const std::filesystem::path& folder, std::size_t step, std::size_t most) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (is_motion_file(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::vector<Clip> out;
  for (std::size_t i = 0; i < files.size() && out.size() < most; i += step) out.push_back(read_clip(files[i]));
  return out;
}

double bytes_per_frame(const std::vector<Clip>& clips, const Bytes& stream) {
  double frames = 0;
  for (const Clip& clip : clips) frames += clip.frames;
  return static_cast<double>(stream.size()) / frames;
}

TEST(RealData, half_a_centimetre_takes_few_bytes_at_30_hz) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const std::vector<Clip> clips = read_some(data / "bandai2", 24, 40);
  const Bytes stream = encode("motion-space", clips, {.target = {.mean_error_cm = 0.5}});
  const ClipErrorSums error = test::error_of(clips, open_stream(stream, "s")->decode_all());
  EXPECT_LE(error.mean_cm(), 0.5);
  EXPECT_LE(error.shell_cm(), 1.6 * error.mean_cm());
  EXPECT_LE(bytes_per_frame(clips, stream), 2.6);  // 40 clips pay for the tables; the whole set takes less
}

TEST(RealData, half_a_centimetre_takes_few_bytes_at_120_hz) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const std::vector<Clip> clips = read_some(data / "cmu" / "02", 1, 4);
  const Bytes stream = encode("motion-space", clips, {.target = {.mean_error_cm = 0.5}});
  const ClipErrorSums error = test::error_of(clips, open_stream(stream, "s")->decode_all());
  EXPECT_LE(error.mean_cm(), 0.5);
  EXPECT_LE(error.shell_cm(), 1.6 * error.mean_cm());
  EXPECT_LE(bytes_per_frame(clips, stream), 3.6);
}

TEST(RealData, no_joint_of_any_clip_passes_the_largest_error) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const std::vector<Clip> clips = read_some(data / "bandai2", 97, 10);
  const Bytes stream = encode("motion-space", clips, {.target = {.max_error_cm = 1}});
  EXPECT_LE(test::error_of(clips, open_stream(stream, "s")->decode_all()).largest, 1);
}

}  // namespace
}  // namespace kinespace
