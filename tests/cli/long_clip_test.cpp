// What a recording of a hundred thousand frames takes: memory in proportion to its numbers, at most a few hundred
// megabytes. `kinespace bench long` measures the rest, up to a million.
#include "tests/support/long_clip.h"

#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/motion/bvh.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

TEST(LongClip, a_hundred_thousand_frames_take_at_most_400_megabytes) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  constexpr double most_megabytes = 4000;  // a sanitizer takes its own
#else
  constexpr double most_megabytes = 400;
#endif
  const TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  write_bvh(folder / "one.bvh", make_walk().clip);
  write_bvh(folder / "long.bvh", over_and_over(make_walk().clip, 100'000));
  ASSERT_EQ(run_command({"build", path("one.bvh"), "-o", path("one.kspace")}).code, 0);
  const std::vector<std::vector<std::string>> lines = {
      {"info", path("long.bvh")},
      {"query", path("one.kspace"), path("long.bvh")},
      {"build", path("long.bvh"), "-o", path("long.kspace")},
      {"clean", path("long.bvh"), "-o", path("clean.bvh")},
      {"encode", path("long.bvh"), "-o", path("long.ksm")},
  };
  for (const auto& line : lines) {
    const CommandResult result = run_command(line);
    EXPECT_EQ(result.code, 0) << line[0] << ": " << result.err;
    EXPECT_LT(static_cast<double>(result.peak_bytes) / 1e6, most_megabytes) << line[0];
  }
}

}  // namespace
}  // namespace kinespace::test
