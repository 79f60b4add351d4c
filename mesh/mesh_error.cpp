#include "kinespace/mesh/mesh_error.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh/detail/rotation_fit.h"

namespace kinespace {
namespace {

void require_same_shape(const MeshSequence& a, const MeshSequence& b) {
  const auto fail = [&](std::string found, std::string expected) {
    throw Error(ErrorKind::bad_input, {.file = b.name, .found = std::move(found), .expected = std::move(expected)});
  };
  if (a.vertices != b.vertices) {
    fail(fmt::format("{} vertices", b.vertices), fmt::format("{} as in {}", a.vertices, a.name));
  }
  if (a.frames != b.frames) fail(fmt::format("{} frames", b.frames), fmt::format("{} as in {}", a.frames, a.name));
  if (a.triangles != b.triangles && canonical_triangles(a.triangles) != canonical_triangles(b.triangles)) {
    fail("other triangles", "those of " + a.name);
  }
}

double squared(double x) {
  return x * x;
}

double squared_distance(const float* a, const float* b) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) sum += squared(static_cast<double>(a[c]) - static_cast<double>(b[c]));
  return sum;
}

double spread_about_means_over_time(const MeshSequence& mesh) {
  Points mean = Points::Zero(mesh.vertices, 3);
  // Divided at the end: then equal frames have themselves for a mean, to the last bit, and their spread is none.
  for (int f = 0; f < mesh.frames; ++f) mean += frame_points(mesh, f);
  mean /= mesh.frames;
  double sum = 0;
  for (int f = 0; f < mesh.frames; ++f) sum += (frame_points(mesh, f) - mean).squaredNorm();
  return sum;
}

double percent(double error, double spread) {
  if (error == 0) return 0;
  return spread > 0 ? 100 * std::sqrt(error / spread) : std::numeric_limits<double>::quiet_NaN();
}

double rigidity_weight(const MeshSequence& mesh) {
  const double size = diagonal(mesh);
  return size > 0 ? 1e4 / (size * size) : 0;
}

// Calls `report(vertex, energy)`, the energies without alpha.
template <typename Report>
void rigidity(const Neighbours& neighbours, const Points& a, const Points& b, const Report& report) {
  for (int i = 0; i < neighbours.vertices(); ++i) {
    const auto ring = neighbours.of(i);
    Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
    const auto weight = [&](std::int32_t j) {
      return 1.0 / static_cast<double>(ring.size() + neighbours.of(j).size());
    };
    for (const std::int32_t j : ring) m += weight(j) * (b.row(i) - b.row(j)).transpose() * (a.row(i) - a.row(j));
    const Eigen::Matrix3d r = nearest_rotation(m);
    double energy = 0;
    for (const std::int32_t j : ring) {
      energy += weight(j) * (r * (a.row(i) - a.row(j)).transpose() - (b.row(i) - b.row(j)).transpose()).squaredNorm();
    }
    report(i, energy);
  }
}

}  // namespace

double squared_spread(const MeshSequence& mesh) {
  double sum = 0;
  for (int f = 0; f < mesh.frames; ++f) {
    const Points x = frame_points(mesh, f);
    sum += (x.rowwise() - x.colwise().mean().eval()).squaredNorm();
  }
  return sum;
}

MeshError compare_positions(const MeshSequence& a, const MeshSequence& b) {
  require_same_shape(a, b);
  MeshError out;
  out.vertices = a.vertices;
  out.frames = a.frames;
  double error = 0, worst = 0;
  for (std::size_t i = 0; i < a.positions.size(); i += 3) {
    const double here = squared_distance(a.positions.data() + i, b.positions.data() + i);
    error += here;
    worst = std::max(worst, here);
  }
  out.kg = percent(error, squared_spread(a));
  out.kg_time = percent(error, spread_about_means_over_time(a));
  out.max_vertex_error = std::sqrt(worst);
  const double size = diagonal(a);
  out.max_error_over_diagonal = size > 0 ? out.max_vertex_error / size : 0;
  return out;
}

MeshError compare(const MeshSequence& a, const MeshSequence& b) {
  MeshError out = compare_positions(a, b);
  const Neighbours neighbours(a.vertices, a.triangles);
  double sum = 0;
  for (int f = 0; f < a.frames; ++f) {
    rigidity(neighbours, frame_points(a, f), frame_points(b, f), [&](int, double energy) { sum += energy; });
  }
  out.lr = rigidity_weight(a) * sum / a.frames;
  return out;
}

std::vector<double> vertex_errors(const MeshSequence& a, const MeshSequence& b, int frame) {
  require_same_shape(a, b);
  std::vector<double> out(static_cast<std::size_t>(a.vertices));
  const auto x = a.frame(frame), y = b.frame(frame);
  for (std::size_t v = 0; v < out.size(); ++v) {
    out[v] = std::sqrt(squared_distance(x.data() + 3 * v, y.data() + 3 * v));
  }
  return out;
}

std::vector<double> vertex_rigidity_errors(const MeshSequence& a, const MeshSequence& b, int frame) {
  require_same_shape(a, b);
  std::vector<double> out(static_cast<std::size_t>(a.vertices));
  const double alpha = rigidity_weight(a);
  rigidity(Neighbours(a.vertices, a.triangles), frame_points(a, frame), frame_points(b, frame),
           [&](int vertex, double energy) { out[static_cast<std::size_t>(vertex)] = alpha * energy; });
  return out;
}

}  // namespace kinespace
