// A libFuzzer target for the decoders of meshes: every codec there is, and "mesh-paper", which is mesh-harmonics by the
// paper's profile.
#include <algorithm>
#include <string>
#include <vector>

#include "kinespace/mesh_codecs/mesh_codec.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::fuzz {

std::vector<std::string> codecs() {
  std::vector<std::string> out(mesh_codecs().begin(), mesh_codecs().end());
  out.emplace_back("mesh-paper");
  return out;
}

// Small, since every input solves for the functions; with all the parts that a stream can have.
const Bytes& good_stream() {
  static const Bytes stream = [] {
    const MeshSequence mesh = test::joined(test::bending_tube(64, 5, 1.0), test::sheet(5, 4, 5));
    const std::string name = codec();
    if (name == "mesh-paper") {
      return encode_mesh("mesh-harmonics", mesh, {.profile = MeshProfile::paper, .bases = 12, .clusters = 2});
    }
    if (name == "mesh-harmonics") return encode_mesh(name, mesh, {.kg = 8.0, .bases = 12, .coarse_vertices = 50});
    return encode_mesh(name, mesh, {.kg = 2.0});
  }();
  return stream;
}

void decode(std::span<const std::byte> bytes) {
  const auto reader = open_mesh_stream(bytes, "fuzzed");
  const int frames = reader->layout().frames;
  for (int f = 0; f < frames; f += 1 + frames / 4) static_cast<void>(reader->frame(f));
}

}  // namespace kinespace::fuzz
