// The motions nearest to a clip: yoo2019's distance in the space of whole clips, and the best of these again by time
// warping.
//
// The vectors are searched by the exact L2 distance of all dimensions (eq. 3, or eq. 14 with joint weights), of which an
// OpenCL device, where one is to be used, leaves those that its rounding cannot tell from the nearest ones; the
// `candidates` best are then compared by DTW of their keyframes (eq. 12; a slanted band of 10 % of the length, cost
// divided by the sum of both lengths, since a sum alone favours short clips) and ordered by that. Ties go to the clip
// that was added first. Of a clip of more than 10 000 frames the band is narrower, by rerank_band, so that a clip that
// is ten times as long takes ten times the work and not a hundred times.
#pragma once

#include <string>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/kernels/device.h"
#include "kinespace/library/library_view.h"

namespace kinespace {

struct QueryOptions {
  int k = 10;                       // matches wanted, >= 1
  bool rerank = true;               // order the best again by DTW
  int candidates = 50;              // of which so many, >= k counts as k
  bool weighted = false;            // joint weights (eq. 14) in the vector distance
  double band = 0.1;                // of the DTW, (0, 1]
  std::vector<std::string> labels;  // only clips that have all of these

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

// What share of the lengths the band of a pair is: `band`, but for pairs with a clip of more than 10 000 frames as much
// as makes ten million cells, or 100 keyframes (3.3 s) to both sides where that is more.
struct RerankClip {
  int frames = 0;
  int keyframes = 0;  // fpca/pose_features.h
};
[[nodiscard]] double rerank_band(double band, const RerankClip& a, const RerankClip& b);

struct Match {
  std::string clip;
  double distance = 0;         // with rerank the normalised DTW cost, else the L2 distance of the vectors
  double vector_distance = 0;  // always the latter
  double start_s = 0;          // what of the clip matches: all of it
  double end_s = 0;
  std::vector<std::string> labels;
};

// The clips of the library nearest to `clip`, nearest first; `except` (a clip's name) is left out. No clips of that
// joint tree: no matches. The clip may be of any frame rate and of other bone lengths.
[[nodiscard]] std::vector<Match> nearest_motions(LibraryView& library, const Clip& clip,
                                                 const QueryOptions& options = {}, const std::string& except = {},
                                                 const Compute& compute = {}, const Progress& progress = {});
// The same for curves of a skeleton, as LibraryView::curves gives them; moved in, those of a long clip do not stay in
// memory beside those of the library's.
[[nodiscard]] std::vector<Match> nearest_motions(LibraryView& library, ClipCurves curves, const Skeleton& skeleton,
                                                 const QueryOptions& options = {}, const std::string& except = {},
                                                 const Compute& compute = {}, const Progress& progress = {});

}  // namespace kinespace
