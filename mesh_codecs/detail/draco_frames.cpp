#include "kinespace/mesh_codecs/detail/draco_frames.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh_codecs/detail/measured_mesh.h"
#include "kinespace/mesh_codecs/key_mesh.h"
#include "kinespace/mesh_codecs/mesh_layout.h"
#include "kinespace/mesh_codecs/step_search.h"

namespace kinespace {
namespace {

Grid grid_over(const MeshSequence& mesh, double step) {
  Grid out = grid_for(frame_points(mesh, 0), step);
  for (int f = 1; f < mesh.frames; ++f) {
    const Grid other = grid_for(frame_points(mesh, f), step);
    for (std::size_t d = 0; d < 3; ++d) out.origin[d] = std::min(out.origin[d], other.origin[d]);
  }
  return out;
}

PackedKeyMesh packed_frame(const MeshSequence& mesh, const std::vector<Triangle>& triangles, const Grid& grid, int f) {
  return pack_key_mesh(
      {.vertices = mesh.vertices, .triangles = triangles, .keys = {grid.quantised(frame_points(mesh, f))}});
}

// Bytes of some frames, for all.
double estimated_bytes(const MeshSequence& mesh, const std::vector<Triangle>& triangles, const Grid& grid,
                       const Progress& progress) {
  const int tried = std::min(mesh.frames, 3);
  double sum = 0;
  for (int i = 0; i < tried; ++i) {
    progress.check_stop();
    sum += static_cast<double>(packed_frame(mesh, triangles, grid, i * mesh.frames / tried).surface.size());
  }
  return sum / tried * mesh.frames;
}

double error_on(const MeshSequence& mesh, const Grid& grid, const Progress& progress) {
  return measured(
             mesh, [&](int f) { return grid.points(grid.quantised(frame_points(mesh, f))); }, false, progress)
      .kg;
}

Bytes stream_on(const MeshSequence& mesh, const std::vector<Triangle>& triangles, const Grid& grid,
                const Progress& progress) {
  std::vector<PackedKeyMesh> frames(static_cast<std::size_t>(mesh.frames));
  constexpr int together = 8;
  for (int from = 0; from < mesh.frames; from += together) {
    progress.check_stop();
    progress.at("frames", static_cast<double>(from) / mesh.frames);
    parallel_for(from, std::min(from + together, mesh.frames),
                 [&](int f) { frames[static_cast<std::size_t>(f)] = packed_frame(mesh, triangles, grid, f); });
  }
  const MeshError error = measured(
      mesh, [&](int f) { return grid.points(grid.quantised(frame_points(mesh, f))); }, true, progress);
  KeyMesh flat{.vertices = mesh.vertices, .triangles = triangles, .keys = {}};
  flat.keys.emplace_back(static_cast<std::size_t>(mesh.vertices));
  const PackedKeyMesh joined = pack_key_mesh(flat);
  const std::size_t order = frames[0].order.size();
  BitstreamWriter out("mesh-codec:mesh-draco");
  set_measured(out, error,
               static_cast<std::int64_t>(order + joined.surface.size() * static_cast<std::size_t>(mesh.frames)));
  ByteWriter setup;
  put_layout(setup, layout_of(mesh));
  put_grid(setup, grid);
  out.add_section("setup", std::move(setup).take());
  out.add_section("order", frames[0].order);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    out.add_section(fmt::format("f{}", f), frames[f].surface);
    if (frames[f].order != frames[0].order) out.add_section(fmt::format("o{}", f), frames[f].order);
  }
  return finish_mesh_stream(std::move(out), layout_of(mesh));
}

class DracoReader final : public MeshStreamReader {
 public:
  explicit DracoReader(Bitstream stream) : stream_(std::move(stream)) {
    ByteReader in(stream_.section("setup"), stream_.source());
    described_ = get_layout(in, stream_.size());
    grid_ = get_grid(in);
    in.expect_end();
    layout_ = empty_sequence(described_, unpacked(0).triangles);
  }
  [[nodiscard]] const Bitstream& stream() const override { return stream_; }
  [[nodiscard]] const MeshSequence& layout() const override { return layout_; }
  [[nodiscard]] Points frame(int f) const override { return grid_.points(unpacked(f).keys[0]); }
  [[nodiscard]] std::int64_t connectivity_bytes() const override {
    return stream_.integer_option("connectivity", 0, std::int64_t{1} << 40);
  }

 private:
  [[nodiscard]] KeyMesh unpacked(int f) const {
    const std::string own = fmt::format("o{}", f);
    return unpack_key_mesh(stream_.section(fmt::format("f{}", f)),
                           stream_.section(stream_.has_section(own) ? own : "order"), described_.vertices,
                           described_.triangles, 1, stream_.source());
  }
  Bitstream stream_;
  MeshLayout described_;
  Grid grid_;
  MeshSequence layout_;
};

}  // namespace

Bytes encode_draco_frames(const MeshSequence& mesh, const MeshCodecOptions& options) {
  constexpr int most_frames = 30'000;  // a section each
  if (mesh.frames > most_frames) {
    throw Error(ErrorKind::usage, {.found = fmt::format("{} frames for mesh-draco", mesh.frames),
                                   .expected = fmt::format("at most {}", most_frames)});
  }
  const auto triangles = canonical_triangles(mesh.triangles);
  const double size = std::max(diagonal(mesh), double{std::numeric_limits<float>::min()});
  Grid grid = grid_over(mesh, size / 1000);
  const double least = size * 1e-8;
  double step = 0;
  if (options.bytes) {
    const auto inverse = [&](double fineness) {
      grid.step = 1 / fineness;
      return estimated_bytes(mesh, triangles, grid, options.progress);
    };
    const double room = 0.99 * static_cast<double>(*options.bytes) - 30.0 * mesh.frames -
                        static_cast<double>(packed_frame(mesh, triangles, grid, 0).order.size());
    const double fineness = largest_step(512 / size, 1 / size, room, 0.02, 10, inverse);
    step = fineness > 0 ? 1 / fineness : 0;
  } else {
    const auto error = [&](double at) {
      grid.step = at;
      return error_on(mesh, grid, options.progress);
    };
    const double kg = options.kg.value_or(MeshCodecOptions::usual_kg);
    step = largest_step(size / 500, least, kg, 0.01, 14, error);
    const double reached = step > 0 ? 0 : error(least);
    if (reached > kg) {
      throw Error(ErrorKind::usage, {.found = fmt::format("a kg of {} percent", kg),
                                     .expected = fmt::format("{:.4g} or more for this sequence", reached)});
    }
  }
  grid.step = step > 0 ? step : least;
  Bytes out = step > 0 || !options.bytes ? stream_on(mesh, triangles, grid, options.progress) : Bytes();
  if (options.bytes && (out.empty() || static_cast<std::int64_t>(out.size()) > *options.bytes)) {
    throw Error(ErrorKind::usage, {.found = fmt::format("{} bytes for the stream", *options.bytes),
                                   .expected = "more for this sequence"});
  }
  return out;
}

std::unique_ptr<MeshStreamReader> open_draco_frames(Bitstream stream) {
  return std::make_unique<DracoReader>(std::move(stream));
}

}  // namespace kinespace
