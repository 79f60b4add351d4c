// How far one mesh sequence is from another.
//
//   kg       100 |A - B|_F / |A - E(A)|_F percent, E(A) the centroid of each frame (karni 2004; chen2019 eq. 9)
//   kg_time  the same with E(A) the mean over time of each vertex; large for a sequence that hardly moves, and NaN for
//            one that stands still (0 when B is A as well)
//   lr       local rigidity (chen2019 eq. 10 and 11): mean over frames of
//                alpha * sum over vertices i of min over rotations R of
//                    sum over j in N(i) of w_ij |R (a_i - a_j) - (b_i - b_j)|^2
//            N(i): the 1-ring by the triangles (the paper's radius epsilon is not given), w_ij = 1 / (|N(i)| + |N(j)|),
//            alpha = 1e4 / diagonal^2, the diagonal of the box around all frames of A. Zero when every 1-ring of every
//            frame of B is a rigidly moved one of A. Rotations only: a mirrored neighbourhood is an error.
#pragma once

#include <span>
#include <vector>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

struct MeshError {
  int vertices = 0;
  int frames = 0;
  double kg = 0;
  double kg_time = 0;
  double lr = 0;
  double max_vertex_error = 0;  // Euclidean, in the files' unit
  double max_error_over_diagonal = 0;
};

// `a` is the reference. Throws Error{bad_input} when vertices, frames or triangles differ; the order of the triangles,
// and which of a triangle's vertices comes first, do not matter.
[[nodiscard]] MeshError compare(const MeshSequence& a, const MeshSequence& b);

// The same without lr, which takes most of the time (it is 0 here): for searches over many settings.
[[nodiscard]] MeshError compare_positions(const MeshSequence& a, const MeshSequence& b);

// |A - E(A)|^2 with the centroid of each frame, over all frames: kg is 100 sqrt(|A - B|^2 / this).
[[nodiscard]] double squared_spread(const MeshSequence& mesh);

// Distance of every vertex in one frame, and its share of the frame's lr (already times alpha), for pictures.
[[nodiscard]] std::vector<double> vertex_errors(const MeshSequence& a, const MeshSequence& b, int frame);
[[nodiscard]] std::vector<double> vertex_rigidity_errors(const MeshSequence& a, const MeshSequence& b, int frame);

}  // namespace kinespace
