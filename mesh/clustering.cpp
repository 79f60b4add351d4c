#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/rigid.h"
#include "kinespace/motion/simd.h"

namespace kinespace {
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
