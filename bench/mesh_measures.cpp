#include "bench/mesh_measures.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <string>

#include <malloc.h>
#include <tbb/global_control.h>

#include "bench/timing.h"
#include "kinespace/base/parallel.h"
#include "kinespace/mesh/harmonics.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh/projection.h"
#include "kinespace/mesh/rigid.h"
#include "kinespace/mesh/smooth_basis.h"
#include "kinespace/mesh_codecs/harmonics_analysis.h"
#include "kinespace/mesh_codecs/step_search.h"

namespace kinespace {
namespace {

double least_of_three(const std::function<void()>& work) {
  double best = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 3; ++round) best = std::min(best, seconds(work));
  return best;
}

double projected_kg(const MeshSequence& mesh, const std::vector<RigidMotion>& motions, const Projection& space) {
  std::vector<double> missed(static_cast<std::size_t>(mesh.frames));
  parallel_for(0, mesh.frames, [&](int f) {
    const Points x = motions[static_cast<std::size_t>(f)].undo(frame_points(mesh, f));
    missed[static_cast<std::size_t>(f)] = (x - space.synthesise(space.coefficients(x))).squaredNorm();
  });
  double sum = 0;
  for (const double m : missed) sum += m;
  return 100 * std::sqrt(sum) / std::sqrt(squared_spread(mesh));
}

// A line of /proc/self/status, in kB; none where there is no such file.
std::optional<double> status_kb(const std::string& field) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(field + ":")) continue;
    const std::size_t digits = std::min(line.find_first_of("0123456789"), line.size());
    double value = 0;
    const auto read = std::from_chars(line.data() + digits, line.data() + line.size(), value);
    return read.ec == std::errc() ? std::optional(value) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

CodedMesh encode_only(std::string_view codec, const MeshSequence& mesh, const MeshCodecOptions& options) {
  CodedMesh out;
  MeshPoint& p = out.point;
  p.encode_s = seconds([&] { out.stream = encode_mesh(codec, mesh, options); });
  const Bitstream stream = Bitstream::parse(out.stream, "bench");
  p.bytes = static_cast<std::int64_t>(out.stream.size());
  p.bpvf = bits_per_vertex_and_frame(p.bytes, mesh);
  p.without_connectivity =
      bits_per_vertex_and_frame(p.bytes - stream.integer_option("connectivity", 0, std::int64_t{1} << 40), mesh);
  p.kg = stream.number_option("kg", 0, 1e6);
  p.lr = stream.number_option("lr", 0, 1e30);
  return out;
}

CodedMesh code_mesh(std::string_view codec, const MeshSequence& mesh, const MeshCodecOptions& options) {
  CodedMesh out = encode_only(codec, mesh, options);
  const MeshError error = compare(mesh, open_mesh_stream(out.stream, "bench")->decode_all());
  out.point.kg = error.kg;
  out.point.lr = error.lr;
  return out;
}

double milliseconds_a_frame(const MeshStreamReader& reader) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  constexpr int looked_at = 9;
  std::vector<double> all;
  for (int i = 0; i < looked_at; ++i) {
    const int f = (2 * i + 1) * reader.layout().frames / (2 * looked_at);
    all.push_back(1000 * least_of_three([&] { static_cast<void>(reader.frame(f)); }));
  }
  std::sort(all.begin(), all.end());
  return all[looked_at / 2];  // key-frames cost next to nothing
}

BasisSeconds basis_seconds(const MeshSequence& mesh, int functions) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Points key = frame_points(mesh, 0);
  BasisSeconds out;
  out.smooth = least_of_three([&] { static_cast<void>(smooth_basis(key, mesh.triangles, {.functions = functions})); });
  out.harmonics =
      least_of_three([&] { static_cast<void>(manifold_harmonics(key, mesh.triangles, {.functions = functions})); });
  return out;
}

ProjectionError projection_error(const MeshSequence& mesh, int functions) {
  const Points key = frame_points(mesh, 0);
  const auto motions = rigid_motions(mesh);
  return {.smooth = projected_kg(mesh, motions,
                                 Projection(smooth_basis(key, mesh.triangles, {.functions = functions}).functions)),
          .harmonics = projected_kg(
              mesh, motions, Projection(manifold_harmonics(key, mesh.triangles, {.functions = functions}).functions))};
}

double estimated_bpvf(const MeshSequence& mesh, double kg, int functions, bool eigenvectors) {
  const double spread = std::sqrt(squared_spread(mesh));
  const double rms = kg / 100 * spread / std::sqrt(3.0 * mesh.vertices * mesh.frames);
  const HarmonicsSettings settings{.key = cluster_frames(mesh, {.clusters = 1}).medoid[0],
                                   .functions = std::min(functions, mesh.vertices),
                                   .key_step = harmonics_key_steps * rms,
                                   .eigenvectors = eigenvectors};
  const Progress silent;
  HarmonicsAnalysis analysis(mesh, std::nullopt, settings, silent);
  double least = std::numeric_limits<double>::infinity();
  for (const FrameTransform transform : {FrameTransform::components, FrameTransform::cosines}) {
    analysis.set_transform(transform);
    std::int64_t bytes = 0;
    const double step = largest_step(6 * rms, 1e-6 * rms, kg, 0.005, 12, [&](double at) {
      const auto attempt = analysis.estimate(at);
      bytes = attempt.bytes;
      return 100 * std::sqrt(attempt.squared_error) / spread;
    });
    if (step > 0) least = std::min(least, bits_per_vertex_and_frame(analysis.fixed_bytes() + bytes, mesh));
  }
  return least;
}

double peak_memory_gib(const std::function<void()>& work) {
  constexpr double kb_in_gib = 1024.0 * 1024.0;
  malloc_trim(0);                                 // what earlier work gave back is no longer held
  std::ofstream("/proc/self/clear_refs") << "5";  // the high-water mark falls to what is held now (proc(5))
  work();
  return status_kb("VmHWM").value_or(std::numeric_limits<double>::quiet_NaN()) / kb_in_gib;
}

}  // namespace kinespace
