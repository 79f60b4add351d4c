// Writes the fixtures that are missing: run it for a new version of a format (fixtures/README.md).
#include <filesystem>
#include <span>

#include "base/file.h"
#include "tests/codecs/mesh_fixtures.h"

int main() {
  using namespace kinespace;
  for (const test::MeshFixture& fixture : test::mesh_fixtures()) {
    if (std::filesystem::exists(fixture.path())) continue;
    const Bytes stream = encode_mesh(fixture.codec, test::mesh_fixture_sample(), fixture.options);
    write_file_atomically(fixture.path(), std::span<const std::byte>(stream));
  }
}
