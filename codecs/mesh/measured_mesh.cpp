#include "codecs/mesh/measured_mesh.h"

#include <cmath>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

namespace kinespace {

MeshError measured(const MeshSequence& mesh, const std::function<Points(int)>& frame, bool rigidity) {
  MeshSequence decoded = mesh;
  tbb::parallel_for(0, mesh.frames, [&](int f) { set_frame(decoded, f, frame(f)); });
  return rigidity ? compare(mesh, decoded) : compare_positions(mesh, decoded);
}

void set_measured(BitstreamWriter& out, const MeshError& error, std::int64_t connectivity) {
  out.set_option("kg", fmt::format("{:.5g}", error.kg));
  out.set_option("kg_time", fmt::format("{:.5g}", error.kg_time));
  out.set_option("lr", fmt::format("{:.5g}", error.lr));
  out.set_option("connectivity", connectivity);
}

}  // namespace kinespace
