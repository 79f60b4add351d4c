#include "kinespace/mesh/rigid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/detail/rotation_fit.h"
#include "kinespace/motion/simd.h"

namespace kinespace {
namespace {

Eigen::Vector3d centroid(const Points& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    for (int c = 0; c < 3; ++c) sum[c] += points(v, c);
  }
  return sum / static_cast<double>(points.rows());
}

}  // namespace

Points RigidMotion::apply(const Points& y) const {
  Points out(y.rows(), 3);
  for (Eigen::Index v = 0; v < y.rows(); ++v) {
    for (int c = 0; c < 3; ++c) {
      out(v, c) = rotation(c, 0) * y(v, 0) + rotation(c, 1) * y(v, 1) + rotation(c, 2) * y(v, 2) + translation[c];
    }
  }
  return out;
}

Points RigidMotion::undo(const Points& x) const {
  Points out(x.rows(), 3);
  for (Eigen::Index v = 0; v < x.rows(); ++v) {
    const double a = x(v, 0) - translation[0], b = x(v, 1) - translation[1], d = x(v, 2) - translation[2];
    for (int c = 0; c < 3; ++c) out(v, c) = rotation(0, c) * a + rotation(1, c) * b + rotation(2, c) * d;
  }
  return out;
}

RigidMotion rigid_motion(const Points& from, const Points& to) {
  const Eigen::Vector3d p = centroid(from), q = centroid(to);
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  for (Eigen::Index v = 0; v < from.rows(); ++v) {
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) m(a, b) += (to(v, a) - q[a]) * (from(v, b) - p[b]);
    }
  }
  RigidMotion out;
  out.rotation = nearest_rotation(m);
  for (int c = 0; c < 3; ++c) {
    out.translation[c] = q[c] - (out.rotation(c, 0) * p[0] + out.rotation(c, 1) * p[1] + out.rotation(c, 2) * p[2]);
  }
  return out;
}

std::vector<RigidMotion> rigid_motions(const MeshSequence& mesh, int reference) {
  std::vector<RigidMotion> out(static_cast<std::size_t>(mesh.frames));
  const Points still = frame_points(mesh, reference);
  for (int f = 0; f < mesh.frames; ++f) {
    if (f != reference) out[static_cast<std::size_t>(f)] = rigid_motion(still, frame_points(mesh, f));
  }
  return out;
}

Eigen::Vector3d rotation_numbers(const Eigen::Matrix3d& r) {
  // The largest of the four components of the quaternion is found from the diagonal, the others from it.
  const std::array<double, 4> squares = {1 + r(0, 0) + r(1, 1) + r(2, 2), 1 + r(0, 0) - r(1, 1) - r(2, 2),
                                         1 - r(0, 0) + r(1, 1) - r(2, 2), 1 - r(0, 0) - r(1, 1) + r(2, 2)};
  std::size_t largest = 0;
  for (std::size_t i = 1; i < 4; ++i) largest = squares[i] > squares[largest] ? i : largest;
  const double twice = std::sqrt(squares[largest]);
  const double wx = (r(2, 1) - r(1, 2)) / (2 * twice), wy = (r(0, 2) - r(2, 0)) / (2 * twice),
               wz = (r(1, 0) - r(0, 1)) / (2 * twice), xy = (r(0, 1) + r(1, 0)) / (2 * twice),
               xz = (r(0, 2) + r(2, 0)) / (2 * twice), yz = (r(1, 2) + r(2, 1)) / (2 * twice);
  double w = 0;
  Eigen::Vector3d out;
  switch (largest) {
    case 0:
      w = twice / 2;
      out = {wx, wy, wz};
      break;
    case 1:
      w = wx;
      out = {twice / 2, xy, xz};
      break;
    case 2:
      w = wy;
      out = {xy, twice / 2, yz};
      break;
    default:
      w = wz;
      out = {xz, yz, twice / 2};
      break;
  }
  return w < 0 ? Eigen::Vector3d(-out) : out;
}

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& numbers) {
  double x = numbers[0], y = numbers[1], z = numbers[2];
  double length = x * x + y * y + z * z;
  if (length > 1) {
    const double root = std::sqrt(length);
    x /= root;
    y /= root;
    z /= root;
    length = 1;
  }
  const double w = std::sqrt(1 - length);
  Eigen::Matrix3d out;
  out << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),     //
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y);
  return out;
}

namespace {

// Sum of |a - b| in eight sums side by side, whose order is the same on every machine.
KINESPACE_VECTOR_CLONES
double l1_distance(const double* a, const double* b, std::ptrdiff_t count) {
  constexpr int lanes = 8;
  double sum[lanes] = {};
  std::ptrdiff_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    for (int l = 0; l < lanes; ++l) sum[l] += std::abs(a[i + l] - b[i + l]);
  }
  double all = 0;
  for (const double part : sum) all += part;
  for (; i < count; ++i) all += std::abs(a[i] - b[i]);
  return all;
}

// A generator whose numbers the standard does not leave open (steele 2014, splitmix64).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  int below(int bound) {
    state_ += 0x9e3779b97f4a7c15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    z ^= z >> 31;
    return static_cast<int>((z >> 32) * static_cast<std::uint64_t>(bound) >> 32);
  }

 private:
  std::uint64_t state_;
};

using Medoids = std::vector<std::int32_t>;

// One medoid after the other, each the frame that lowers the cost most (the BUILD step of kaufman and rousseeuw 1990).
Medoids greedy_start(const Eigen::MatrixXd& d, int clusters) {
  const auto frames = static_cast<int>(d.rows());
  Eigen::VectorXd nearest = Eigen::VectorXd::Constant(frames, std::numeric_limits<double>::infinity());
  Medoids out;
  while (static_cast<int>(out.size()) < clusters) {
    int best = -1;
    double best_cost = std::numeric_limits<double>::infinity();
    for (int m = 0; m < frames; ++m) {
      if (std::find(out.begin(), out.end(), m) != out.end()) continue;
      double cost = 0;
      for (int f = 0; f < frames; ++f) cost += std::min(nearest[f], d(f, m));
      if (best < 0 || cost < best_cost) {
        best = m;
        best_cost = cost;
      }
    }
    out.push_back(best);
    nearest = nearest.cwiseMin(d.col(best));
  }
  return out;
}

Medoids random_start(int frames, int clusters, Random& random) {
  std::vector<std::int32_t> all(static_cast<std::size_t>(frames));
  for (int f = 0; f < frames; ++f) all[static_cast<std::size_t>(f)] = f;
  for (int k = 0; k < clusters; ++k)
    std::swap(all[static_cast<std::size_t>(k)], all[static_cast<std::size_t>(k + random.below(frames - k))]);
  all.resize(static_cast<std::size_t>(clusters));
  return all;
}

Clusters assigned(const Eigen::MatrixXd& d, Medoids medoids) {
  std::sort(medoids.begin(), medoids.end());
  Clusters out;
  out.of.resize(static_cast<std::size_t>(d.rows()));
  for (Eigen::Index f = 0; f < d.rows(); ++f) {
    std::size_t best = 0;
    for (std::size_t k = 0; k < medoids.size(); ++k) {
      if (medoids[k] == f) {
        best = k;  // also when another medoid is the same mesh: no cluster may be empty
        break;
      }
      if (d(f, medoids[k]) < d(f, medoids[best])) best = k;
    }
    out.of[static_cast<std::size_t>(f)] = static_cast<std::int32_t>(best);
    out.cost += d(f, medoids[best]);
  }
  out.medoid = std::move(medoids);
  return out;
}

Medoids best_medoids(const Eigen::MatrixXd& d, const Clusters& clusters) {
  Medoids out = clusters.medoid;
  std::vector<double> least(out.size(), std::numeric_limits<double>::infinity());
  for (Eigen::Index m = 0; m < d.rows(); ++m) {
    const auto k = static_cast<std::size_t>(clusters.of[static_cast<std::size_t>(m)]);
    double cost = 0;
    for (Eigen::Index f = 0; f < d.rows(); ++f) {
      if (clusters.of[static_cast<std::size_t>(f)] == static_cast<std::int32_t>(k)) cost += d(f, m);
    }
    if (cost < least[k]) {
      least[k] = cost;
      out[k] = static_cast<std::int32_t>(m);
    }
  }
  return out;
}

Clusters settled(const Eigen::MatrixXd& d, Medoids start) {
  constexpr int most_rounds = 100;
  Clusters now = assigned(d, std::move(start));
  for (int round = 0; round < most_rounds; ++round) {
    Clusters next = assigned(d, best_medoids(d, now));
    if (!(next.cost < now.cost)) break;
    now = std::move(next);
  }
  return now;
}

}  // namespace

void ClusterOptions::validate(int frames) const {
  const auto fail = [](const char* field, int value, const std::string& range) {
    throw Error(ErrorKind::usage, {.found = fmt::format("{} = {}", field, value), .expected = range});
  };
  if (clusters < 1 || clusters > frames) {
    fail("clusters", clusters, fmt::format("1 to {}, the number of frames", frames));
  }
  if (starts < 0 || starts > 1000) fail("starts", starts, "0 to 1000");
}

Clusters cluster(const Eigen::MatrixXd& distances, const ClusterOptions& options) {
  const auto frames = static_cast<int>(distances.rows());
  options.validate(frames);
  Clusters best = settled(distances, greedy_start(distances, options.clusters));
  Random random(options.seed);
  for (int start = 0; start < options.starts; ++start) {
    Clusters other = settled(distances, random_start(frames, options.clusters, random));
    if (other.cost < best.cost) best = std::move(other);
  }
  return best;
}

Eigen::MatrixXd frame_distances(const MeshSequence& mesh) {
  // Frames in tiles, so that a sequence larger than memory's speed is not read once for every pair.
  constexpr int tile = 16;
  const std::vector<RigidMotion> motions = rigid_motions(mesh, 0);
  const auto aligned = [&](int f) { return motions[static_cast<std::size_t>(f)].undo(frame_points(mesh, f)); };
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(mesh.frames, mesh.frames);
  std::vector<Points> rows;
  for (int first = 0; first < mesh.frames; first += tile) {
    const int end = std::min(first + tile, mesh.frames);
    rows.clear();
    for (int f = first; f < end; ++f) rows.push_back(aligned(f));
    for (int g = first + 1; g < mesh.frames; ++g) {
      const Points other = aligned(g);
      for (int f = first; f < std::min(end, g); ++f) {
        const Points& row = rows[static_cast<std::size_t>(f - first)];
        out(f, g) = out(g, f) = l1_distance(row.data(), other.data(), other.size());
      }
    }
  }
  return out;
}

Clusters cluster_frames(const MeshSequence& mesh, const ClusterOptions& options) {
  options.validate(mesh.frames);
  return cluster(frame_distances(mesh), options);
}

}  // namespace kinespace
