// The self-distance table of a group: the L2 distance of every two of its frames in the group's space (lin2011, figure
// 6), in the units of the frames.
//
// Nothing of the table is stored but the coefficients; tiles of it are computed when they are wanted, in single
// precision. A pixel stands for `stride` frames, by the first of them. Between two ranges of frames that do not follow
// each other in one clip stands a pixel that is far from everything (is_gap), so that no path crosses from one to the
// next. Distances below `floor` are read as `floor`: rounding must not make valleys of a held pose.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/repeats/frame_table.h"
#include "kinespace/repeats/group_space.h"

namespace kinespace {

class SelfDistance {
 public:
  // A tile: rows and columns of squared distances.
  using Tile = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  // `stride` >= 1. The ranges are those of one group, in time.
  SelfDistance(const GroupSpace& space, const FrameTable& table, std::span<const FrameSpan> ranges, int stride);

  [[nodiscard]] int size() const { return static_cast<int>(coefficients_.cols()); }
  [[nodiscard]] int stride() const { return stride_; }
  [[nodiscard]] double pixel_rate_hz() const { return rate_hz_ / stride_; }

  [[nodiscard]] bool is_gap(int pixel) const { return run_[static_cast<std::size_t>(pixel)] < 0; }
  // Which of the ranges the pixel lies in; -1 for a gap.
  [[nodiscard]] int run(int pixel) const { return run_[static_cast<std::size_t>(pixel)]; }
  [[nodiscard]] int run_count() const { return static_cast<int>(ranges_.size()); }
  [[nodiscard]] FrameSpan run_frames(int run) const { return ranges_[static_cast<std::size_t>(run)]; }
  [[nodiscard]] int run_first_pixel(int run) const { return first_pixel_[static_cast<std::size_t>(run)]; }
  // The frame a pixel stands for; of the pixel after a run's last, the frame after the run's last.
  [[nodiscard]] std::int64_t frame(int pixel, int run) const;

  // The distance of two pixels; neither a gap.
  [[nodiscard]] float at(int i, int j) const;
  // Squared distances, not below floor^2, of rows [row, row + out.rows()) and columns [column, column + out.cols()).
  void tile(int row, int column, Eigen::Ref<Tile> out) const;

  // The root mean square of the distance of two frames drawn from the group.
  [[nodiscard]] double typical() const { return typical_; }
  [[nodiscard]] double floor() const { return floor_; }

 private:
  Eigen::MatrixXf coefficients_;  // [axis][pixel]
  Eigen::VectorXf squares_;       // [pixel]; of a gap, far more than of any frame
  std::vector<int> run_;          // of each pixel
  std::vector<FrameSpan> ranges_;
  std::vector<int> first_pixel_;  // of each run
  int stride_ = 1;
  double rate_hz_ = 0;
  double typical_ = 0;
  double floor_ = 0;
};

}  // namespace kinespace
