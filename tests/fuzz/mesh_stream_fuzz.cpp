// A libFuzzer target for one mesh codec's decoder, KINESPACE_FUZZ_CODEC; "mesh-paper" is mesh-harmonics by the paper's
// profile.
#include <algorithm>
#include <string_view>

#include "kinespace/mesh_codecs/mesh_codec.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::fuzz {

// Small, since every input solves for the functions; with all the parts that a stream can have.
const Bytes& good_stream() {
  static const Bytes stream = [] {
    const MeshSequence mesh = test::joined(test::bending_tube(64, 5, 1.0), test::sheet(5, 4, 5));
    constexpr std::string_view codec = KINESPACE_FUZZ_CODEC;
    if (codec == "mesh-paper") {
      return encode_mesh("mesh-harmonics", mesh, {.profile = MeshProfile::paper, .bases = 12, .clusters = 2});
    }
    if (codec == "mesh-harmonics") return encode_mesh(codec, mesh, {.kg = 8.0, .bases = 12, .coarse_vertices = 50});
    return encode_mesh(codec, mesh, {.kg = 2.0});
  }();
  return stream;
}

void decode(std::span<const std::byte> bytes) {
  const auto reader = open_mesh_stream(bytes, "fuzzed");
  const int frames = reader->layout().frames;
  for (int f = 0; f < frames; f += 1 + frames / 4) static_cast<void>(reader->frame(f));
}

}  // namespace kinespace::fuzz
