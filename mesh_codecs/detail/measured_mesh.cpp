#include "kinespace/mesh_codecs/detail/measured_mesh.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/parallel.h"

namespace kinespace {

MeshError measured(const MeshSequence& mesh, const std::function<Points(int)>& frame, bool rigidity,
                   const Progress& progress) {
  MeshSequence decoded = mesh;
  constexpr int together = 16;
  for (int from = 0; from < mesh.frames; from += together) {
    progress.check_stop();
    parallel_for(from, std::min(from + together, mesh.frames), [&](int f) { set_frame(decoded, f, frame(f)); });
  }
  return rigidity ? compare(mesh, decoded) : compare_positions(mesh, decoded);
}

void set_measured(BitstreamWriter& out, const MeshError& error, std::int64_t connectivity) {
  const auto set = [&out](const char* key, double value) {
    if (std::isfinite(value)) out.set_option(key, fmt::format("{:.5g}", value));
  };
  set("kg", error.kg);
  set("kg_time", error.kg_time);
  set("lr", error.lr);
  out.set_option("connectivity", connectivity);
}

}  // namespace kinespace
