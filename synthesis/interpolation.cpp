#include "kinespace/synthesis/interpolation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/synthesis/curve_sampler.h"
#include "kinespace/synthesis/detail/library_clips.h"
#include "kinespace/synthesis/detail/time_alignment.h"

namespace kinespace {
namespace {

// The clips to blend, then the library's clips that are among the k nearest of any of them.
struct Neighbourhood {
  std::vector<ClipRow> rows;
  Eigen::MatrixXd vectors;  // in the space of clips
};

Neighbourhood neighbourhood(LibraryView& library, std::vector<ClipRow> rows, int neighbours) {
  const RetrievalMatrix matrix = library.library().retrieval_matrix(rows.front().space_id);
  const auto count = static_cast<Eigen::Index>(matrix.clip_ids.size());
  const Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> all(
      matrix.values.data(), count, static_cast<Eigen::Index>(matrix.dimensions));
  std::vector<Eigen::Index> chosen;
  for (const ClipRow& row : rows)
    chosen.push_back(std::ranges::find(matrix.clip_ids, row.id) - matrix.clip_ids.begin());
  const std::size_t given = chosen.size();
  for (std::size_t g = 0; g < given; ++g) {
    const Eigen::VectorXf distance = (all.rowwise() - all.row(chosen[g])).rowwise().squaredNorm();
    std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return distance(i); });
    int taken = 0;
    for (const Eigen::Index i : order) {
      if (taken == neighbours) break;
      if (std::find(chosen.begin(), chosen.begin() + static_cast<std::ptrdiff_t>(given), i) !=
          chosen.begin() + static_cast<std::ptrdiff_t>(given)) {
        continue;
      }
      ++taken;
      if (std::ranges::find(chosen, i) == chosen.end()) chosen.push_back(i);
    }
  }
  Neighbourhood out{.rows = std::move(rows),
                    .vectors = Eigen::MatrixXd(static_cast<Eigen::Index>(chosen.size()), all.cols())};
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    out.vectors.row(static_cast<Eigen::Index>(i)) = all.row(chosen[i]).cast<double>();
    if (i >= given) {
      out.rows.push_back(library.library().clip(matrix.clip_ids[static_cast<std::size_t>(chosen[i])]));
    }
  }
  return out;
}

Eigen::VectorXd plain_weights(const std::vector<double>& weights) {
  const Eigen::Map<const Eigen::VectorXd> given(weights.data(), static_cast<Eigen::Index>(weights.size()));
  return given / given.sum();
}

}  // namespace

double motion_distance_cm(const ClipCurves& a, const ClipCurves& b, const Skeleton& skeleton) {
  constexpr int looks = 40;
  const TimeMap map = align_times(a, b, skeleton);
  const CurveSampler first(a), second(b);
  ClipCurves poses{.rate_hz = 1, .values = SampleMatrix(2 * looks, a.values.cols())};
  for (int i = 0; i < looks; ++i) {
    const double time = map.from_s() * i / (looks - 1);
    first.at(time, poses.values.row(2 * i));
    second.at(map(time), poses.values.row(2 * i + 1));
  }
  poses.values.leftCols(3).setZero();
  const JointPositions positions = joint_positions(clip_from_curves(poses, skeleton));
  double sum = 0;
  for (int i = 0; i < looks; ++i) {
    for (int j = 0; j < positions.joints; ++j) sum += (positions.at(2 * i, j) - positions.at(2 * i + 1, j)).norm();
  }
  return sum / (looks * positions.joints);
}

void BlendOptions::validate(std::size_t clips) const {
  const auto fail = [](const std::string& found, const std::string& expected) {
    throw Error(ErrorKind::usage, {.found = found, .expected = expected});
  };
  if (clips == 0) fail("no clips", "one clip or more");
  if (weights) {
    if (weights->size() != clips)
      fail(fmt::format("{} weights", weights->size()), fmt::format("one a clip: {}", clips));
    const double sum = std::accumulate(weights->begin(), weights->end(), 0.0);
    if (!std::isfinite(sum) || std::abs(sum) < 1e-6)
      fail(fmt::format("weights with the sum {}", sum), "a sum that is not 0");
  }
  if (at && !(*at >= 0 && *at <= static_cast<double>(clips - 1))) {
    fail(fmt::format("at = {}", *at), fmt::format("from 0 (the first clip) to {} (the last)", clips - 1));
  }
  if (neighbours < 0) fail(fmt::format("neighbours = {}", neighbours), "0 or more");
}

Blend make_blend(LibraryView& library, std::span<const std::string> clips, const BlendOptions& options) {
  options.validate(clips.size());
  std::vector<ClipRow> rows = clips_of_one_tree(library, clips);
  const Skeleton& skeleton = library.skeleton(rows.front().skeleton_id);

  WeightCurve weights;
  std::optional<BezierWeights> bezier;
  if (options.weights) {
    weights = [w = plain_weights(*options.weights)](double) { return w; };
  } else {
    const Neighbourhood near = neighbourhood(library, rows, options.neighbours);
    bezier = BezierWeights::through_motions(near.vectors, static_cast<int>(clips.size()));
    // Of the neighbours only those that became control points are played.
    std::vector<Eigen::Index> used;
    for (Eigen::Index i = 0; i < near.vectors.rows(); ++i) {
      if (i < std::ssize(clips) || !bezier->controls().col(i).isZero()) used.push_back(i);
    }
    rows.clear();
    for (const Eigen::Index i : used) rows.push_back(near.rows[static_cast<std::size_t>(i)]);
    bezier = BezierWeights(Eigen::MatrixXd(bezier->controls()(Eigen::all, used)));
    if (options.at) {
      weights = [w = bezier->at(*options.at)](double) { return w; };
    } else {
      weights = [&curve = *bezier](double share) { return curve.at(share * curve.segments()); };
    }
  }

  std::vector<ClipCurves> motions;
  for (const ClipRow& row : rows) motions.push_back(library.curves(row, options.functions));
  BlendedMotion blended = blend_motions(motions, skeleton, weights);
  Blend out{.clip = std::move(blended.clip), .ratios = blended.ratios};
  for (std::size_t i = clips.size(); i < rows.size(); ++i) out.controls.push_back(rows[i].name);
  out.clip.name.clear();
  for (const std::string& name : clips) out.clip.name += (out.clip.name.empty() ? "" : "~") + name;
  const double first_s = (motions[0].frames() - 1) / motions[0].rate_hz;
  out.scale = first_s > 0 ? out.clip.duration_s() / first_s : 1;
  for (std::size_t i = 0; i + 1 < clips.size(); ++i) {
    out.cost_cm = std::max(out.cost_cm, motion_distance_cm(motions[i], motions[i + 1], skeleton));
  }
  return out;
}

}  // namespace kinespace
