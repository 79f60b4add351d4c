// The curves of a library at the rate of the filling model, and the search for windows like one's own. Private to this
// folder.
//
// Units of all features: metres, and for quaternions metres a joint moves (curve_weights), so that distances are mean
// distances of joints.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/base/progress.h"
#include "kinespace/fpca/space_builder.h"

namespace kinespace {

using FeatureMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline constexpr double filling_rate_hz = 30;

// A stretch of motion at an even rate.
struct FillTrack {
  FeatureMatrix root;   // [frame] x y z in metres (y above the floor of the file), w x y z, continuous
  FeatureMatrix body;   // [frame] weighted quaternions of the other joints, on the library's side
  FeatureMatrix index;  // [frame] main axes of body, for the search
  [[nodiscard]] int frames() const { return static_cast<int>(root.rows()); }
};

// Which frames of a window are seen, and how it is placed.
struct WindowShape {
  int before = 0;  // seen frames before the gap; the last of them places the window
  int gap = 0;
  int after = 0;
  [[nodiscard]] int frames() const { return before + gap + after; }
  [[nodiscard]] int reference() const { return before - 1; }
  [[nodiscard]] bool seen(int row) const { return row < before || row >= before + gap; }
};

struct FillWindow {
  double distance = 0;  // squared, of the seen part
  int track = 0;        // of the library; from tracks() on, of the extra tracks
  int start = 0;
};

class FillLibrary {
 public:
  FillLibrary(const PreparedSource& clips, const Progress& progress);

  [[nodiscard]] const Skeleton& skeleton() const { return skeleton_; }
  [[nodiscard]] const CurveLayout& layout() const { return layout_; }
  [[nodiscard]] std::span<const FillTrack> tracks() const { return tracks_; }
  [[nodiscard]] int frames() const { return frames_; }
  // What a feature is over what the curve is: [curve].
  [[nodiscard]] const Eigen::RowVectorXd& weights() const { return weights_; }
  [[nodiscard]] int curves() const { return static_cast<int>(weights_.size()); }

  // Rows of curves (metres, quaternions; y above the floor) as a track.
  [[nodiscard]] FillTrack track_of(const SampleMatrix& curves) const;

  // A window of a track as features: [row][curve], heading and ground position of the reference row taken out.
  void window(const FillTrack& track, int start, const WindowShape& shape, Eigen::Ref<FeatureMatrix> out) const;

  struct Search {
    int count = 300;
    int without = -1;                    // a track of the library that does not count
    bool free_placement = false;         // where the part after the gap is does not count, only what it looks like
    std::span<const FillTrack> extra{};  // more tracks
  };
  // The windows whose seen part is nearest to that of `query` (a track of shape.frames() frames, any values in the
  // gap), nearest first; equal ones in the order of tracks. Fewer where the library has fewer.
  [[nodiscard]] std::vector<FillWindow> nearest(const FillTrack& query, const WindowShape& shape,
                                                const Search& search) const;

 private:
  void find_axes();

  Skeleton skeleton_;
  CurveLayout layout_;
  Eigen::RowVectorXd weights_;
  Eigen::Matrix4Xd references_;  // the hemisphere of each joint's quaternions
  Eigen::MatrixXf axes_;         // body x index
  std::vector<FillTrack> tracks_;
  int frames_ = 0;
};

// Curves at the model's rate, y above the floor: the first row is the first frame's.
[[nodiscard]] SampleMatrix resampled_curves(const ClipCurves& curves, double rate_hz);

// Root features (x y z, w x y z; not weighted) as seen from a reference frame: heading and ground position taken out.
[[nodiscard]] Eigen::Matrix<float, 1, 7> placed_root(const float* root, const float* reference);

}  // namespace kinespace
