// Motion spaces and clips of earlier versions: fixtures/README.md.
#include <algorithm>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/base/file.h"
#include "kinespace/library/detail/space_codec.h"
#include "kinespace/motion/error_measures.h"

namespace kinespace {
namespace {

Bytes fixture(const std::string& name) {
  const FileContent content(std::filesystem::path(KINESPACE_FIXTURES) / name);
  const auto bytes = content.bytes();
  return {bytes.begin(), bytes.end()};
}

Clip walk() {
  for (SampleMotion& motion : sample_library({.takes = 1})) {
    if (motion.clip.name == "walk_normal_001") return std::move(motion.clip);
  }
  return {};
}

class LibraryFixture : public ::testing::TestWithParam<std::string> {
 protected:
  [[nodiscard]] RegisteredSpace space() const {
    const std::string name = "space_" + GetParam() + ".ksm";
    return unpack_registered_space(fixture(name), name);
  }
  [[nodiscard]] EncodedClip clip(const Clip& original) const {
    const auto part = [this](const char* table) {
      return fixture(std::string("clip_") + table + "_" + GetParam() + ".ksm");
    };
    const EncodedClip header{.name = original.name, .rate_hz = original.rate_hz, .frames = original.frames};
    return unpack_clip({part("vectors"), part("warps"), part("sides")}, space(), original.skeleton, header, GetParam());
  }
};
INSTANTIATE_TEST_SUITE_P(All, LibraryFixture, ::testing::Values("v1", "v2", "v3"),
                         [](const auto& version) { return version.param; });

TEST_P(LibraryFixture, plays_as_near_to_what_was_read_as_was_measured_when_it_was_made) {
  const Clip original = walk();
  ASSERT_EQ(original.frames, 186);
  const EncodedClip encoded = clip(original);
  const MotionError error = compare(original, clip_from_curves(decode(space(), encoded), original.skeleton));
  EXPECT_NEAR(error.mean_joint_error_cm, encoded.error.mean_joint_error_cm, 1e-3);
  EXPECT_NEAR(error.max_joint_error_cm, encoded.error.max_joint_error_cm, 1e-2);
  EXPECT_LT(error.mean_joint_error_cm, 1);
  for (const LevelError& l : encoded.levels) {
    const Clip decoded = clip_from_curves(decode(space(), encoded, l.level), original.skeleton);
    EXPECT_NEAR(compare(original, decoded).mean_joint_error_cm, l.error.mean_joint_error_cm, 1e-3) << l.level;
    EXPECT_NEAR(compare(original, decoded).max_joint_error_cm, l.error.max_joint_error_cm, 1e-2) << l.level;
  }
}

TEST(LibraryFixtures, of_version_1_have_one_set_of_functions_and_no_ends_apart) {
  const RegisteredSpace space = unpack_registered_space(fixture("space_v1.ksm"), "space_v1.ksm");
  EXPECT_EQ(space.sets().size(), 1U);
  EXPECT_FALSE(space.options().pinned);
  EXPECT_EQ(space.levels(), 8);
}

TEST(LibraryFixtures, of_version_2_have_sequences_of_whole_cycles) {
  const RegisteredSpace space = unpack_registered_space(fixture("space_v2.ksm"), "space_v2.ksm");
  EXPECT_TRUE(space.options().pinned);
  EXPECT_GT(space.sets().size(), 1U);
}

// Coarser levels have had other slopes beside cuts since; what was measured of them then is not what is played.
TEST(LibraryFixtures, of_version_2_promise_the_error_of_all_functions_alone) {
  const RegisteredSpace space = unpack_registered_space(fixture("space_v2.ksm"), "space_v2.ksm");
  const std::vector<LevelError> levels = unpack_level_errors(fixture("clip_sides_v2.ksm"), space, "v2");
  ASSERT_EQ(levels.size(), 1U);
  EXPECT_EQ(levels.front().level, space.levels());
}

TEST(LibraryFixtures, of_version_3_have_more_detail_for_fast_motion_and_feet) {
  const RegisteredSpace space = unpack_registered_space(fixture("space_v3.ksm"), "space_v3.ksm");
  const Clip original = walk();
  const EncodedClip clip = unpack_clip(
      {fixture("clip_vectors_v3.ksm"), fixture("clip_warps_v3.ksm"), fixture("clip_sides_v3.ksm")}, space,
      original.skeleton, {.name = original.name, .rate_hz = original.rate_hz, .frames = original.frames}, "v3");
  int most_detail = 0;
  for (const EncodedRun& run : clip.runs) {
    for (const EncodedSequence& s : run.sequences) most_detail = std::max(most_detail, s.extra_detail);
  }
  EXPECT_GT(most_detail, 0);
  ASSERT_TRUE(clip.feet);
  EXPECT_GT(clip.feet->contacts.size(), 2U);
}

}  // namespace
}  // namespace kinespace
