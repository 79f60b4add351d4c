#include "kinespace/synthesis/detail/filling_core.h"

#include <algorithm>
#include <cmath>

#include "kinespace/motion/curves.h"

namespace kinespace {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr WindowPrior near_prior{.scale_m = 0.3};
constexpr WindowPrior far_prior{.scale_m = 0.1};

// d positions (cm) / d features at one row: [3 joint + axis][curve].
Eigen::MatrixXd position_slopes(const FillLibrary& library, const Eigen::RowVectorXd& row) {
  constexpr double step = 1e-4;
  std::vector<JointFrame> base;
  std::vector<JointFrame> moved;
  feature_frames(library, row, base);
  Eigen::MatrixXd out(3 * static_cast<Index>(base.size()), row.size());
  Eigen::RowVectorXd other = row;
  for (Index c = 0; c < row.size(); ++c) {
    other(c) = row(c) + step;
    feature_frames(library, other, moved);
    other(c) = row(c);
    for (std::size_t j = 0; j < base.size(); ++j) {
      out.col(c).segment<3>(3 * static_cast<Index>(j)) = (moved[j].position - base[j].position) / step;
    }
  }
  return out;
}

// The squares of three rows a joint, added, on one axis.
Eigen::VectorXd by_joint(const Eigen::VectorXd& squares) {
  Eigen::VectorXd out(squares.size() / 3);
  for (Index j = 0; j < out.size(); ++j) out(j) = squares.segment<3>(3 * j).sum() / 3;
  return out;
}

GapSpread spread_of(const FillLibrary& library, const WindowEstimate& near, const WindowEstimate& far,
                    const SampleMatrix& mean, std::vector<int> rows) {
  GapSpread out{.rows = std::move(rows), .variance = {}};
  const auto count = static_cast<Index>(out.rows.size());
  for (auto& v : out.variance) v = Eigen::MatrixXd::Zero(count, library.skeleton().joint_count());
  for (Index i = 0; i < count; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const int r = out.rows[n];
    const Eigen::MatrixXf slopes = position_slopes(library, mean.row(r)).cast<float>();
    out.variance[0].row(i) = by_joint((slopes * far.modes[n]).rowwise().squaredNorm().cast<double>()).transpose();
    out.variance[1].row(i) = by_joint(slopes.rowwise().squaredNorm().cast<double>() * far.open_variance(i)).transpose();
    const Eigen::VectorXf apart = slopes * (near.mean.row(r) - far.mean.row(r)).transpose().cast<float>() / 2;
    out.variance[2].row(i) = by_joint(apart.cwiseAbs2().cast<double>()).transpose();
  }
  return out;
}

std::vector<int> spread_rows(const WindowShape& shape) {
  constexpr int step = 3;
  std::vector<int> out;
  for (int r = 0; r < shape.gap - 1; r += step) out.push_back(r);
  if (shape.gap > 0) out.push_back(shape.gap - 1);
  return out;
}

}  // namespace

void feature_frames(const FillLibrary& library, const Eigen::RowVectorXd& features, std::vector<JointFrame>& out) {
  const Skeleton& skeleton = library.skeleton();
  const std::vector<int>& joints = library.layout().joints;
  const Eigen::RowVectorXd& weights = library.weights();
  const auto count = static_cast<std::size_t>(skeleton.joint_count());
  out.assign(count, {.position = 100 * features.head<3>().transpose()});
  std::size_t next = 0;
  for (auto j = static_cast<std::size_t>(joints.front()); j < count; ++j) {
    const Joint& joint = skeleton.joints[j];
    if (next > 0) {
      const JointFrame& parent = out[static_cast<std::size_t>(joint.parent)];
      out[j] = {.rotation = parent.rotation, .position = parent.position + parent.rotation * joint.offset};
    }
    if (next >= joints.size() || joints[next] != static_cast<int>(j)) continue;
    const Eigen::Vector4d q =
        features.segment<4>(3 + 4 * static_cast<Index>(next)).transpose() / weights(3 + 4 * static_cast<Index>(next));
    out[j].rotation = out[j].rotation * Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized();
    ++next;
  }
}

GapEstimate estimate_gap(const FillLibrary& library, const FillOptions& options, const FillTrack& query,
                         const WindowShape& shape, FillLibrary::Search search) {
  search.count = options.far_windows;
  const std::vector<FillWindow> windows = library.nearest(query, shape, search);
  GapEstimate out{.mean = SampleMatrix(0, library.curves()), .spread = {}, .windows = static_cast<int>(windows.size())};
  if (windows.size() < 2) return out;
  const Index curves = library.curves();
  FeatureMatrix members(static_cast<Index>(windows.size()), shape.frames() * curves);
  std::vector<double> distances;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const auto all = library.tracks().size();
    const auto t = static_cast<std::size_t>(windows[i].track);
    const FillTrack& track = t < all ? library.tracks()[t] : search.extra[t - all];
    library.window(track, windows[i].start, shape,
                   Eigen::Map<FeatureMatrix>(members.row(static_cast<Index>(i)).data(), shape.frames(), curves));
    distances.push_back(windows[i].distance);
  }
  FeatureMatrix seen(shape.frames(), curves);
  library.window(query, 0, shape, seen);
  WindowPrior near = near_prior;
  WindowPrior far = far_prior;
  near.windows = options.near_windows;
  far.windows = options.far_windows;
  const SampleMatrix observed = seen.cast<double>();
  std::vector<int> rows = spread_rows(shape);
  const WindowEstimate a = estimate_window(members, distances, observed, shape, near, {});
  const WindowEstimate b = estimate_window(members, distances, observed, shape, far, rows);
  out.mean = (a.mean + b.mean) / 2;
  out.spread = spread_of(library, a, b, out.mean, std::move(rows));
  return out;
}

}  // namespace kinespace
