// The streams in fixtures/, which every build decodes to the same bits: what they were made of, and how.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "kinespace/mesh_codecs/mesh_codec.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {

struct MeshFixture {
  std::string name;
  std::string codec;
  MeshCodecOptions options;
  std::uint64_t positions;  // XXH3 of the decoded positions

  [[nodiscard]] std::filesystem::path path() const {
    return std::filesystem::path(KINESPACE_FIXTURES) / (name + "_v1.ksm");
  }
};

inline MeshSequence mesh_fixture_sample() {
  return joined(bending_tube(400, 12, 1.2), sheet(12, 9, 12));
}

inline std::vector<MeshFixture> mesh_fixtures() {
  return {MeshFixture{"mesh_standard", "mesh-harmonics", {.kg = 0.5, .bases = 80}, 0xe8e14a0f9cbeda61},
          MeshFixture{
              "mesh_coarse", "mesh-harmonics", {.kg = 2.5, .bases = 60, .coarse_vertices = 250}, 0x2aa24f2aa84f318a},
          MeshFixture{"mesh_paper",
                      "mesh-harmonics",
                      {.kg = 2.5, .profile = MeshProfile::paper, .bases = 60, .clusters = 2},
                      0x1a3ce614a12c541e},
          MeshFixture{"mesh_pca", "mesh-pca", {.kg = 0.5}, 0x459893ff4e3d0c7a},
          MeshFixture{"mesh_draco", "mesh-draco", {.kg = 2}, 0x508e67410df36294}};
}

}  // namespace kinespace::test
