// Streams of clips as they were written once: every build, debug or release, by whatever compiler, decodes them to the
// same bits.
#include "tests/codecs/clip_fixtures.h"

#include <set>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace kinespace::test {
namespace {

class FixedClipStream : public testing::TestWithParam<ClipFixture> {};
INSTANTIATE_TEST_SUITE_P(All, FixedClipStream, testing::ValuesIn(clip_fixtures()),
                         [](const auto& fixture) { return fixture.param.name; });

TEST_P(FixedClipStream, decodes_to_the_same_bits_in_every_build) {
  const ClipFixture& fixture = GetParam();
  const FileContent file(fixture.path());
  const std::optional<PoseSpaceBasis> basis = fixture.with_basis ? std::optional(basis_of_fixture()) : std::nullopt;
  for (const std::size_t threads : {1U, 3U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto reader = open_stream(file.bytes(), fixture.path().string(), basis ? &*basis : nullptr);
    const std::vector<Clip> decoded = reader->decode_all();
    EXPECT_EQ(decoded_checksum(decoded), fixture.values) << "0x" << std::hex << decoded_checksum(decoded);
    const double error = reader->stream().error().mean_joint_error_cm;
    if (!(error > 0)) continue;  // what is kept as it was
    const std::vector<Clip> sample = clip_fixture_sample();
    const ClipErrorSums measured = error_of({sample.begin(), sample.begin() + fixture.clips}, decoded);
    EXPECT_NEAR(measured.mean_cm(), error, 1e-4 * error + 1e-6);
  }
}

TEST(ClipFixtures, are_there_for_every_codec_and_small) {
  std::set<std::string_view> missing;
  for (const Codec* codec : all_codecs()) missing.insert(codec->name());
  for (const ClipFixture& fixture : clip_fixtures()) {
    missing.erase(fixture.codec);
    EXPECT_LE(std::filesystem::file_size(fixture.path()), 20'000U) << fixture.name;
  }
  EXPECT_EQ(missing, std::set<std::string_view>{});
}

}  // namespace
}  // namespace kinespace::test
