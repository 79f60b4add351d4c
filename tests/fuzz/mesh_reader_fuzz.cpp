// A libFuzzer target for one reader of meshes, KINESPACE_FUZZ_READER: obj, ply, npy, gltf, glb.
#include <cstdint>
#include <string_view>

#include "kinespace/base/error.h"
#include "kinespace/mesh/detail/mesh_formats.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::fuzz {
namespace {

// The first byte of NumPy's input says which of the two files the rest is; the other one is good.
void read_numpy(std::string_view bytes) {
  if (bytes.empty()) return;
  static const MeshSequence mesh = test::sheet(3, 3, 2);
  static const std::string positions = format_numpy_positions(mesh), triangles = format_numpy_triangles(mesh.triangles);
  const std::string_view rest = bytes.substr(1);
  if (bytes[0] % 2 == 0) {
    static_cast<void>(parse_numpy(rest, "p.npy", triangles, "t.npy"));
  } else {
    static_cast<void>(parse_numpy(positions, "p.npy", rest, "t.npy"));
  }
}

void read(std::string_view bytes) {
  constexpr std::string_view reader = KINESPACE_FUZZ_READER;
  // As much as scripts/fuzz lets one allocation take. Nothing beside the file can be read.
  constexpr std::uint64_t most_bytes = 60'000'000;
  if (reader == "obj") static_cast<void>(parse_obj(bytes, "fuzzed"));
  if (reader == "ply") static_cast<void>(parse_ply(bytes, "fuzzed"));
  if (reader == "npy") read_numpy(bytes);
  if (reader == "gltf" || reader == "glb") {
    static_cast<void>(parse_gltf_mesh(bytes, "/nowhere/fuzzed.gltf", {.most_bytes = most_bytes}));
  }
}

}  // namespace
}  // namespace kinespace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    kinespace::fuzz::read({reinterpret_cast<const char*>(data), size});
  } catch (const kinespace::Error&) {
    // What a reader owes hostile bytes.
  }
  return 0;
}
