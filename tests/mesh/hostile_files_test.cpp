// Damaged mesh files: every one is an error or a valid mesh; never a crash, a hang or much memory.
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/detail/mesh_formats.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

MeshSequence sequence_of(const MeshFrame& frame) {
  return {.name = "h",
          .vertices = static_cast<int>(frame.positions.size() / 3),
          .frames = 1,
          .positions = frame.positions,
          .triangles = frame.triangles};
}

using Parse = MeshSequence (*)(const std::string&);

MeshSequence parse_as_obj(const std::string& bytes) {
  return sequence_of(parse_obj(bytes, "h.obj"));
}
MeshSequence parse_as_ply(const std::string& bytes) {
  return sequence_of(parse_ply(bytes, "h.ply"));
}
MeshSequence parse_as_positions(const std::string& bytes) {
  return parse_numpy(bytes, "h.npy", format_numpy_triangles(sheet(3, 3, 2).triangles), "t.npy");
}
MeshSequence parse_as_triangles(const std::string& bytes) {
  return parse_numpy(format_numpy_positions(sheet(3, 3, 2)), "p.npy", bytes, "h.npy");
}
MeshSequence parse_as_gltf(const std::string& bytes) {
  return parse_gltf_mesh(bytes, "/nowhere/h.gltf", {});
}

struct Case {
  const char* name;
  std::string bytes;
  Parse parse;
};

class HostileMesh : public testing::TestWithParam<Case> {};

// True for a mesh.
bool outcome(Parse parse, const std::string& bytes) {
  try {
    require_valid(parse(bytes), "what was read");
    return true;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
    EXPECT_FALSE(error.details().file.empty() || error.details().found.empty()) << error.what();
    return false;
  }
}

TEST_P(HostileMesh, the_whole_file_is_a_mesh) {
  EXPECT_TRUE(outcome(GetParam().parse, GetParam().bytes));
}

TEST_P(HostileMesh, every_prefix_is_an_error_or_a_mesh) {
  const auto& [name, bytes, parse] = GetParam();
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    SCOPED_TRACE(length);
    outcome(parse, bytes.substr(0, length));
    if (HasFailure()) return;
  }
}

TEST_P(HostileMesh, every_flipped_bit_is_an_error_or_a_mesh) {
  const auto& [name, bytes, parse] = GetParam();
  std::string damaged = bytes;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      SCOPED_TRACE(testing::Message() << at << " bit " << bit);
      damaged[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << bit));
      outcome(parse, damaged);
      if (HasFailure()) return;
    }
    damaged[at] = bytes[at];
  }
}

TEST_P(HostileMesh, many_changed_bytes_are_an_error_or_a_mesh) {
  const auto& [name, bytes, parse] = GetParam();
  std::mt19937 random(1);
  for (int trial = 0; trial < 3000; ++trial) {
    std::string damaged = bytes;
    for (int i = 0; i < 1 + trial % 5; ++i) {
      const std::size_t at = random() % damaged.size();
      // Digits and signs reach further in a text than any byte would.
      damaged[at] = trial % 2 == 0 ? static_cast<char>(random()) : "0123456789-.,e"[random() % 14];
    }
    SCOPED_TRACE(trial);
    outcome(parse, damaged);
    if (HasFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Formats, HostileMesh,
    testing::Values(Case{"obj", format_obj(sheet(3, 3, 1).positions, sheet(3, 3, 1).triangles), parse_as_obj},
                    Case{"ply", format_ply(sheet(3, 3, 1).positions, sheet(3, 3, 1).triangles), parse_as_ply},
                    Case{"positions", format_numpy_positions(sheet(3, 3, 2)), parse_as_positions},
                    Case{"triangles", format_numpy_triangles(sheet(3, 3, 2).triangles), parse_as_triangles},
                    Case{"gltf", format_gltf_mesh(sheet(2, 2, 2), false), parse_as_gltf},
                    Case{"glb", format_gltf_mesh(sheet(2, 2, 2), true), parse_as_gltf}),
    [](const auto& param) { return param.param.name; });

}  // namespace
}  // namespace kinespace::test
