// Fewer vertices, the same ones in every frame, and the others back from them.
//
// Quadric edge collapse (garland and heckbert 1997, by meshoptimizer) decides once, on one frame. The vertices that
// stay are a subset of the fine ones, so one list of indices serves all frames (chen2019's "ghost" mesh, figure 8).
//
// Back: in a key-frame that both sides know, a removed vertex p lies over the coarse triangle nearest to it, with
// barycentric weights w_k of the nearest point and coarse corners a_k. In another frame, with corners b_k and the
// rotations R_k of the coarse 1-rings,
//
//   p' = sum over k of w_k (b_k + R_k (p - a_k))
//
// Vertices that stay come back exactly, and a rigid motion is followed exactly.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

struct DecimationOptions {
  int vertices = 10'000;  // about as many stay; 4 to 100 000 000 (more than there are: all stay)
  int frame = -1;         // that decides, 0 to frames - 1; -1: the middle one

  // Throws Error{usage} naming field, value and legal range.
  void validate(const MeshSequence& mesh) const;
};

struct Decimation {
  std::vector<std::int32_t> kept;   // fine indices of the coarse vertices, ascending
  std::vector<Triangle> triangles;  // of coarse indices
};

// Boundaries collapse along themselves only. A vertex of every component and all isolated vertices stay. Where the
// topology does not allow so few vertices there are more: look at kept.size(). Another version of meshoptimizer may
// decide otherwise, so a stream holds `kept` and the triangles rather than rely on it.
[[nodiscard]] Decimation decimate(const MeshSequence& mesh, const DecimationOptions& options = {});

// The sequence of the coarse meshes.
[[nodiscard]] MeshSequence coarse_sequence(const MeshSequence& mesh, const Decimation& decimation);

// Fine frames from coarse ones.
class Refinement {
 public:
  // `key`: a fine frame; `fine_triangles` say which coarse triangles may be near a vertex. Throws Error{bad_input} when
  // an index of the decimation is out of range or `kept` is not ascending: both may come from a stream.
  Refinement(const Points& key, std::span<const Triangle> fine_triangles, const Decimation& decimation);

  [[nodiscard]] int fine_vertices() const { return static_cast<int>(followers_.size()); }
  [[nodiscard]] int coarse_vertices() const { return static_cast<int>(coarse_key_.rows()); }
  // `coarse` has a row for each kept vertex. The same bits on every machine.
  [[nodiscard]] Points apply(const Points& coarse) const;

 private:
  struct Follower {
    std::array<std::int32_t, 3> corner{};              // coarse vertices
    std::array<double, 3> weight{};                    // (1, 0, 0) for a vertex that stays
    Eigen::Matrix3d offset = Eigen::Matrix3d::Zero();  // p - a_k by columns
  };

  Points coarse_key_;
  Neighbours coarse_neighbours_;
  std::vector<Follower> followers_;
};

}  // namespace kinespace
