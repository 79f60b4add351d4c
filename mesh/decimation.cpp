#include "kinespace/mesh/decimation.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <meshoptimizer.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

[[noreturn]] void fail_usage(const char* field, int value, const std::string& range) {
  throw Error(ErrorKind::usage, {.found = fmt::format("{} = {}", field, value), .expected = range});
}

std::vector<unsigned> indices_of(std::span<const Triangle> triangles) {
  std::vector<unsigned> out;
  out.reserve(triangles.size() * 3);
  for (const Triangle& t : triangles) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    for (const std::int32_t v : t) out.push_back(static_cast<unsigned>(v));
  }
  return out;
}

// Which fine vertices some triangle has.
std::vector<bool> used_vertices(std::span<const unsigned> indices, int vertices) {
  std::vector<bool> out(static_cast<std::size_t>(vertices));
  for (const unsigned v : indices) out[v] = true;
  return out;
}

std::vector<unsigned> simplified(const MeshSequence& mesh, int frame, std::span<const unsigned> indices,
                                 std::size_t triangles) {
  std::vector<unsigned> out(indices.size());
  constexpr float any_error = std::numeric_limits<float>::max();
  out.resize(meshopt_simplify(out.data(), indices.data(), indices.size(), mesh.frame(frame).data(),
                              static_cast<std::size_t>(mesh.vertices), 3 * sizeof(float), triangles * 3, any_error, 0,
                              nullptr));
  return out;
}

// The collapse counts triangles: how many give about so many vertices is found by scaling.
std::vector<unsigned> simplified_to_vertices(const MeshSequence& mesh, int frame, std::span<const unsigned> indices,
                                             std::int64_t wanted) {
  constexpr int most_tries = 4;
  auto triangles =
      static_cast<double>(std::min<std::int64_t>(2 * wanted, static_cast<std::int64_t>(indices.size()) / 3));
  std::vector<unsigned> best;
  double best_distance = std::numeric_limits<double>::infinity();
  for (int i = 0; i < most_tries; ++i) {
    std::vector<unsigned> out = simplified(mesh, frame, indices, static_cast<std::size_t>(triangles));
    const std::vector<bool> used = used_vertices(out, mesh.vertices);
    const auto vertices = static_cast<double>(std::count(used.begin(), used.end(), true));
    const double distance = std::abs(vertices - static_cast<double>(wanted));
    if (distance < best_distance) {
      best_distance = distance;
      best = std::move(out);
    }
    if (vertices < 1 || distance < 0.01 * static_cast<double>(wanted)) break;
    triangles =
        std::clamp(triangles * static_cast<double>(wanted) / vertices, 1.0, static_cast<double>(indices.size()) / 3);
  }
  return best;
}

Decimation all_of(const MeshSequence& mesh) {
  Decimation out;
  for (std::int32_t v = 0; v < mesh.vertices; ++v) out.kept.push_back(v);
  out.triangles = mesh.triangles;
  return out;
}

}  // namespace

void DecimationOptions::validate(const MeshSequence& mesh) const {
  if (vertices < 4 || vertices > most_vertices) fail_usage("vertices", vertices, fmt::format("4 to {}", most_vertices));
  if (frame < -1 || frame >= mesh.frames) {
    fail_usage("frame", frame, fmt::format("0 to {}, or -1 for the middle", mesh.frames - 1));
  }
}

Decimation decimate(const MeshSequence& mesh, const DecimationOptions& options) {
  options.validate(mesh);
  if (options.vertices >= mesh.vertices) return all_of(mesh);
  const int frame = options.frame >= 0 ? options.frame : mesh.frames / 2;
  const std::vector<unsigned> indices = indices_of(mesh.triangles);
  const std::vector<unsigned> coarse =
      indices.empty() ? indices : simplified_to_vertices(mesh, frame, indices, options.vertices);
  std::vector<bool> stays = used_vertices(coarse, mesh.vertices);
  const Components parts = connected_components(Neighbours(mesh.vertices, mesh.triangles));
  std::vector<bool> seen(static_cast<std::size_t>(parts.count));
  for (std::size_t v = 0; v < stays.size(); ++v) {
    if (stays[v]) seen[static_cast<std::size_t>(parts.of[v])] = true;
  }
  for (std::size_t c = 0; c < seen.size(); ++c) {
    if (!seen[c]) stays[static_cast<std::size_t>(parts.first_vertex[c])] = true;
  }
  Decimation out;
  std::vector<std::int32_t> coarse_of(stays.size(), -1);
  for (std::size_t v = 0; v < stays.size(); ++v) {
    if (!stays[v]) continue;
    coarse_of[v] = static_cast<std::int32_t>(out.kept.size());
    out.kept.push_back(static_cast<std::int32_t>(v));
  }
  for (std::size_t i = 0; i + 2 < coarse.size(); i += 3) {
    out.triangles.push_back({coarse_of[coarse[i]], coarse_of[coarse[i + 1]], coarse_of[coarse[i + 2]]});
  }
  return out;
}

MeshSequence coarse_sequence(const MeshSequence& mesh, const Decimation& decimation) {
  MeshSequence out{.name = mesh.name,
                   .rate_hz = mesh.rate_hz,
                   .vertices = static_cast<int>(decimation.kept.size()),
                   .frames = mesh.frames};
  out.positions.reserve(out.frame_size() * static_cast<std::size_t>(mesh.frames));
  for (int f = 0; f < mesh.frames; ++f) {
    const auto fine = mesh.frame(f);
    for (const std::int32_t v : decimation.kept) {
      const auto at = fine.subspan(static_cast<std::size_t>(v) * 3, 3);
      out.positions.insert(out.positions.end(), at.begin(), at.end());
    }
  }
  out.triangles = decimation.triangles;
  return out;
}

}  // namespace kinespace
