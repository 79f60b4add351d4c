#include "kinespace/mesh_codecs/harmonics_space.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "kinespace/entropy/range_coder.h"
#include "kinespace/mesh/deformation.h"
#include "kinespace/mesh/harmonics.h"
#include "kinespace/mesh/smooth_basis.h"
#include "kinespace/mesh_codecs/basis_cache.h"

namespace kinespace {
namespace {

constexpr std::size_t near_anchors = 4;  // of each kind: before and after

struct Distance {
  double squared;
  std::int32_t node;
  friend bool operator<(const Distance& a, const Distance& b) {
    return a.squared < b.squared || (a.squared == b.squared && a.node < b.node);
  }
};

void append_nearest(std::vector<Distance>& all, std::vector<std::int32_t>& out) {
  const std::size_t count = std::min(near_anchors, all.size());
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count), all.end());
  for (std::size_t i = 0; i < count; ++i) out.push_back(all[i].node);
}

// Functions whose anchors lie near each other; the constants have no neighbours.
NodeGraph graph_of_functions(const Points& key, const SmoothBasis& basis) {
  NodeGraph out;
  const int constants = basis.count() - static_cast<int>(basis.anchors.size());
  out.first.push_back(0);
  const auto place = [&](int k) { return basis.anchors[static_cast<std::size_t>(k - constants)]; };
  for (int k = 0; k < basis.count(); ++k) {
    if (k >= constants) {
      std::vector<Distance> before, after;
      for (int m = constants; m < basis.count(); ++m) {
        if (m == k) continue;
        double squared = 0;
        for (int d = 0; d < 3; ++d) {
          const double off = key(place(m), d) - key(place(k), d);
          squared += off * off;
        }
        (m < k ? before : after).push_back({squared, m});
      }
      append_nearest(before, out.near);
      append_nearest(after, out.near);
    }
    out.first.push_back(static_cast<std::int32_t>(out.near.size()));
    out.band.push_back(static_cast<std::uint8_t>(std::min(bit_length(static_cast<std::uint64_t>(k)), 14)));
  }
  return out;
}

// Eigenvectors have no place on the mesh: those of nearly equal eigenvalues are near.
NodeGraph graph_by_number(int functions) {
  constexpr int reach = static_cast<int>(near_anchors);
  NodeGraph out;
  out.first.push_back(0);
  for (int k = 0; k < functions; ++k) {
    for (int m = std::max(k - reach, 0); m <= std::min(k + reach, functions - 1); ++m) {
      if (m != k) out.near.push_back(m);
    }
    out.first.push_back(static_cast<std::int32_t>(out.near.size()));
    out.band.push_back(static_cast<std::uint8_t>(std::min(bit_length(static_cast<std::uint64_t>(k)), 14)));
  }
  return out;
}

NodeGraph graph_of_vertices(const Neighbours& neighbours) {
  NodeGraph out;
  out.first.push_back(0);
  for (int v = 0; v < neighbours.vertices(); ++v) {
    const auto near = neighbours.of(v);
    out.near.insert(out.near.end(), near.begin(), near.end());
    out.first.push_back(static_cast<std::int32_t>(out.near.size()));
    out.band.push_back(0);
  }
  return out;
}

}  // namespace

struct HarmonicsSpace::Basis {
  Basis(const Points& key, const SmoothBasis& basis)
      : functions(basis.functions), graph(graph_of_functions(key, basis)) {}
  explicit Basis(Eigen::MatrixXd eigenvectors)
      : functions(std::move(eigenvectors)), graph(graph_by_number(static_cast<int>(functions.cols()))) {}

  Eigen::MatrixXd functions;
  NodeGraph graph;
};

HarmonicsSpace::HarmonicsSpace(Points key, std::span<const Triangle> triangles, int functions, BasisCache* cache)
    : HarmonicsSpace(key, triangles,
                     Basis{key, cache != nullptr ? cache->smooth(key, triangles, functions)
                                                 : smooth_basis(key, triangles, {.functions = functions})}) {}

HarmonicsSpace::HarmonicsSpace(Points key, std::span<const Triangle> triangles, Basis basis)
    : projection_(basis.functions),
      neighbours_(static_cast<int>(key.rows()), triangles),
      key_coefficients_(projection_.coefficients(key)),
      key_low_(projection_.synthesise(key_coefficients_)),
      detail_(key - key_low_),
      function_graph_(std::move(basis.graph)),
      vertex_graph_(graph_of_vertices(neighbours_)) {}

std::shared_ptr<const HarmonicsSpace> HarmonicsSpace::of_eigenvectors(Points key, std::span<const Triangle> triangles,
                                                                      int functions) {
  Basis basis(manifold_harmonics(key, triangles, {.functions = functions, .tolerance = 1e-7}).functions);
  return std::shared_ptr<const HarmonicsSpace>(new HarmonicsSpace(std::move(key), triangles, std::move(basis)));
}

std::vector<Eigen::Matrix3d> HarmonicsSpace::rotations(const Points& low, bool rotate) const {
  if (!rotate) return {};
  return ring_rotations(neighbours_, key_low_, low);
}

Points HarmonicsSpace::frame(const Points& low, bool rotate, std::span<const double> residual) const {
  const auto turns = rotations(low, rotate);
  Points x = low;
  for (Eigen::Index v = 0; v < x.rows(); ++v) {
    std::array<double, 3> at{detail_(v, 0), detail_(v, 1), detail_(v, 2)};
    if (!residual.empty()) {
      for (std::size_t a = 0; a < 3; ++a) at[a] += residual[3 * static_cast<std::size_t>(v) + a];
    }
    if (!rotate) {
      for (Eigen::Index a = 0; a < 3; ++a) x(v, a) += at[static_cast<std::size_t>(a)];
      continue;
    }
    const Eigen::Matrix3d& r = turns[static_cast<std::size_t>(v)];
    for (Eigen::Index a = 0; a < 3; ++a) x(v, a) += r(a, 0) * at[0] + r(a, 1) * at[1] + r(a, 2) * at[2];
  }
  return x;
}

Coefficients HarmonicsSpace::coefficients(const Points& wanted, bool rotate) const {
  const Coefficients whole = projection_.coefficients(wanted);
  if (!rotate) return whole;
  const Points low = projection_.synthesise(whole);
  return whole - projection_.correlations(frame(low, true, {}) - low);
}

void HarmonicsSpace::residual(const Points& wanted, const Coefficients& c, bool rotate, std::span<double> out) const {
  const Points low = projection_.synthesise(c);
  const auto turns = rotations(low, rotate);
  Points rest = wanted;
  for (Eigen::Index v = 0; v < rest.rows(); ++v) {
    const Eigen::Vector3d detail = detail_.row(v).transpose();
    rest.row(v) -= (rotate ? Eigen::Vector3d(turns[static_cast<std::size_t>(v)] * detail) : detail).transpose();
  }
  Coefficients inside = projection_.correlations(rest);
  inside = -inside;
  projection_.add(inside, rest);
  for (Eigen::Index v = 0; v < rest.rows(); ++v) {
    const Eigen::Vector3d at = rest.row(v).transpose();
    const Eigen::Vector3d back = rotate ? Eigen::Vector3d(turns[static_cast<std::size_t>(v)].transpose() * at) : at;
    for (int a = 0; a < 3; ++a) out[static_cast<std::size_t>(3 * v + a)] = back[a];
  }
}

}  // namespace kinespace
