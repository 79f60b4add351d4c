// Streams as they were written once: every build, debug or release, by whatever compiler, decodes them to the same
// bits.
#include "tests/mesh_codecs/mesh_fixtures.h"

#include <cstdint>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "kinespace/base/file.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh_codecs/mesh_codec.h"

namespace kinespace::test {
namespace {

class FixedMeshStream : public testing::TestWithParam<MeshFixture> {};
INSTANTIATE_TEST_SUITE_P(All, FixedMeshStream, testing::ValuesIn(mesh_fixtures()),
                         [](const auto& fixture) { return fixture.param.name; });

TEST_P(FixedMeshStream, decodes_to_the_same_bits_in_every_build) {
  const FileContent file(GetParam().path());
  for (const std::size_t threads : {1U, 3U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const MeshSequence decoded = open_mesh_stream(file.bytes(), GetParam().path().string())->decode_all();
    EXPECT_EQ(checksum64(std::as_bytes(std::span(decoded.positions))), GetParam().positions)
        << std::hex << checksum64(std::as_bytes(std::span(decoded.positions)));
    EXPECT_LE(compare_positions(mesh_fixture_sample(), decoded).kg, 1.001 * *GetParam().options.kg);
  }
}

}  // namespace
}  // namespace kinespace::test
