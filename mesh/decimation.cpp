#include "kinespace/mesh/decimation.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <utility>

#include <fmt/format.h>
#include <meshoptimizer.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/deformation.h"

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

namespace {

[[noreturn]] void fail(std::string found, std::string expected) {
  throw Error(ErrorKind::bad_input, {.found = std::move(found), .expected = std::move(expected)});
}

void require_fits(const Decimation& decimation, Eigen::Index vertices) {
  const auto& kept = decimation.kept;
  if (kept.empty()) fail("no coarse vertices", "at least one");
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (kept[i] >= 0 && kept[i] < vertices && (i == 0 || kept[i] > kept[i - 1])) continue;
    fail(fmt::format("coarse vertex {} is fine vertex {}", i, kept[i]),
         fmt::format("ascending numbers from 0 to {}", vertices - 1));
  }
  for (const Triangle& t : decimation.triangles) {
    for (const std::int32_t v : t) {
      if (v < 0 || v >= static_cast<std::int32_t>(kept.size())) {
        fail(fmt::format("a coarse triangle has vertex {}", v), fmt::format("0 to {}", kept.size() - 1));
      }
    }
  }
}

Points rows_of(const Points& points, std::span<const std::int32_t> rows) {
  Points out(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = points.row(rows[i]);
  return out;
}

// For every fine vertex the coarse vertex nearest along fine edges; coarse vertex 0 where no edges lead to one.
std::vector<std::int32_t> owners(const Points& key, const Neighbours& neighbours, std::span<const std::int32_t> kept) {
  std::vector<std::int32_t> owner(static_cast<std::size_t>(key.rows()), 0);
  std::vector<double> distance(owner.size(), std::numeric_limits<double>::infinity());
  using Open = std::pair<double, std::int32_t>;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const auto v = static_cast<std::size_t>(kept[i]);
    owner[v] = static_cast<std::int32_t>(i);
    distance[v] = 0;
    open.emplace(0.0, kept[i]);
  }
  while (!open.empty()) {
    const auto [d, v] = open.top();
    open.pop();
    if (d > distance[static_cast<std::size_t>(v)]) continue;
    for (const std::int32_t next : neighbours.of(v)) {
      const double there = d + (key.row(v) - key.row(next)).norm();
      if (!(there < distance[static_cast<std::size_t>(next)])) continue;
      distance[static_cast<std::size_t>(next)] = there;
      owner[static_cast<std::size_t>(next)] = owner[static_cast<std::size_t>(v)];
      open.emplace(there, next);
    }
  }
  return owner;
}

// Barycentric coordinates of the point of a triangle nearest to p (ericson 2005, section 5.1.5).
Eigen::Vector3d nearest_weights(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a;
  const double d1 = ab.dot(p - a), d2 = ac.dot(p - a), d3 = ab.dot(p - b), d4 = ac.dot(p - b), d5 = ab.dot(p - c),
               d6 = ac.dot(p - c);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 - d3 > 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 - d6 > 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double e = d4 - d3, f = d5 - d6;
  if (va <= 0 && e >= 0 && f >= 0 && e + f > 0) return {0, 1 - e / (e + f), e / (e + f)};
  const double sum = va + vb + vc;
  if (!(sum > 0)) return {1, 0, 0};
  return {1 - vb / sum - vc / sum, vb / sum, vc / sum};
}

// The coarse triangles at each coarse vertex.
class TrianglesAt {
 public:
  TrianglesAt(std::size_t vertices, std::span<const Triangle> triangles) : first_(vertices + 1) {
    for (const Triangle& t : triangles) {
      for (const std::int32_t v : t) ++first_[static_cast<std::size_t>(v) + 1];
    }
    for (std::size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
    triangle_.resize(triangles.size() * 3);
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      for (const std::int32_t v : triangles[t]) triangle_[next[static_cast<std::size_t>(v)]++] = t;
    }
  }
  [[nodiscard]] std::span<const std::size_t> of(std::int32_t vertex) const {
    const auto v = static_cast<std::size_t>(vertex);
    return std::span(triangle_).subspan(first_[v], first_[v + 1] - first_[v]);
  }

 private:
  std::vector<std::size_t> first_, triangle_;
};

}  // namespace

Refinement::Refinement(const Points& key, std::span<const Triangle> fine_triangles, const Decimation& decimation)
    : coarse_key_((require_fits(decimation, key.rows()), rows_of(key, decimation.kept))),
      coarse_neighbours_(static_cast<int>(decimation.kept.size()), decimation.triangles),
      followers_(static_cast<std::size_t>(key.rows())) {
  const Neighbours fine(static_cast<int>(key.rows()), fine_triangles);
  const std::vector<std::int32_t> owner = owners(key, fine, decimation.kept);
  const TrianglesAt at(decimation.kept.size(), decimation.triangles);
  const auto corner = [&](std::int32_t v) -> Eigen::Vector3d { return coarse_key_.row(v); };
  for (std::size_t v = 0; v < followers_.size(); ++v) {
    Follower& follower = followers_[v];
    const std::int32_t nearest = owner[v];
    follower.corner.fill(nearest);
    follower.weight = {1, 0, 0};
    const Eigen::Vector3d p = key.row(static_cast<Eigen::Index>(v));
    if (decimation.kept[static_cast<std::size_t>(nearest)] == static_cast<std::int32_t>(v)) continue;
    double least = std::numeric_limits<double>::infinity();
    const auto consider = [&](std::int32_t centre) {
      for (const std::size_t i : at.of(centre)) {
        const Triangle& t = decimation.triangles[i];
        const Eigen::Vector3d a = corner(t[0]), b = corner(t[1]), c = corner(t[2]);
        const Eigen::Vector3d w = nearest_weights(p, a, b, c);
        const double distance = (w[0] * a + w[1] * b + w[2] * c - p).squaredNorm();
        if (!(distance < least)) continue;
        least = distance;
        follower.corner = t;
        follower.weight = {w[0], w[1], w[2]};
      }
    };
    consider(nearest);
    for (const std::int32_t other : coarse_neighbours_.of(nearest)) consider(other);
    for (int k = 0; k < 3; ++k) follower.offset.col(k) = p - corner(follower.corner[static_cast<std::size_t>(k)]);
  }
}

Points Refinement::apply(const Points& coarse) const {
  const std::vector<Eigen::Matrix3d> rotation = ring_rotations(coarse_neighbours_, coarse_key_, coarse);
  Points out(static_cast<Eigen::Index>(followers_.size()), 3);
  for (std::size_t v = 0; v < followers_.size(); ++v) {
    const Follower& follower = followers_[v];
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      if (follower.weight[k] == 0) continue;
      const std::int32_t c = follower.corner[k];
      const Eigen::Vector3d at(coarse(c, 0), coarse(c, 1), coarse(c, 2));
      const Eigen::Matrix3d& r = rotation[static_cast<std::size_t>(c)];
      p += follower.weight[k] * (at + r * follower.offset.col(static_cast<Eigen::Index>(k)));
    }
    out.row(static_cast<Eigen::Index>(v)) = p;
  }
  return out;
}

}  // namespace kinespace
