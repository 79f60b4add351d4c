// Writes the fixtures that are missing: run it for a new version of a format (fixtures/README.md).
#include <filesystem>
#include <functional>
#include <span>

#include "kinespace/base/file.h"
#include "tests/codecs/clip_fixtures.h"
#include "tests/mesh_codecs/mesh_fixtures.h"

namespace {

using namespace kinespace;

void write_if_missing(const std::filesystem::path& path, const std::function<Bytes()>& make) {
  if (!std::filesystem::exists(path)) write_file_atomically(path, std::span<const std::byte>(make()));
}

void write_clip_fixtures() {
  const std::vector<Clip> sample = test::clip_fixture_sample();
  write_if_missing(test::basis_fixture(), [&] { return PoseSpaceBasis::learn(sample).pack(); });
  for (const test::ClipFixture& fixture : test::clip_fixtures()) {
    write_if_missing(fixture.path(), [&] {
      const PoseSpaceBasis basis = test::basis_of_fixture();
      CodecOptions options = fixture.options;
      if (fixture.with_basis) options.basis = &basis;
      return encode(fixture.codec, std::span(sample).first(fixture.clips), options);
    });
  }
}

}  // namespace

int main() {
  for (const test::MeshFixture& fixture : test::mesh_fixtures()) {
    write_if_missing(fixture.path(),
                     [&] { return encode_mesh(fixture.codec, test::mesh_fixture_sample(), fixture.options); });
  }
  write_clip_fixtures();
}
