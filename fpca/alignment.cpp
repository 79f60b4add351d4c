#include "kinespace/fpca/alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/QR>
#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

constexpr int search_points = 32;    // of space time; what the few smooth functions need
constexpr int own_time_points = 65;  // of own time, looked up linearly

void require(bool legal, const char* field, double value, const char* range) {
  if (legal) return;
  throw Error(ErrorKind::usage, {.found = fmt::format("AlignmentOptions::{} = {}", field, value), .expected = range});
}

}  // namespace

void AlignmentOptions::validate() const {
  require(functions >= 1 && functions <= 64, "functions", functions, "1 to 64");
  require(rounds >= 0 && rounds <= 10, "rounds", rounds, "0 to 10");
  require(least_gain >= 0 && least_gain < 1, "least_gain", least_gain, "0 up to, not including, 1");
  require(templates >= 0 && templates <= 1000, "templates", templates, "0 to 1000");
}

WarpSearch::WarpSearch(const MotionSpace& space, const AlignmentOptions& options)
    : options_(options),
      curves_(space.curves()),
      pinned_(space.options().pinned),
      mean_(search_points),
      root_weight_(search_points),
      curve_weight_(curve_weights(space.skeleton()).cast<float>()) {
  options_.validate();
  const FunctionGroup& group = space.groups().front();
  const Eigen::Index n = std::min<Eigen::Index>(2L * options_.functions, group.functions.cols());
  coarse_ = std::min<Eigen::Index>(options_.functions, n);
  SampleMatrix columns(space.points(), n + 1);
  columns << group.mean, group.functions.leftCols(n);
  const UniformSpline spline(std::move(columns));
  const Eigen::VectorXd weight = trapezoid_weights(search_points, 1.0).cwiseSqrt();
  SampleMatrix at(search_points, n + 1);
  for (int i = 0; i < search_points; ++i) {
    spline.value(static_cast<double>(i) / (search_points - 1) * (space.points() - 1), at.row(i));
    at.row(i) *= weight(i);
  }
  mean_ = at.col(0).cast<float>();
  const Eigen::MatrixXd sampled = at.rightCols(n);
  const Eigen::MatrixXd q =
      Eigen::HouseholderQR<Eigen::MatrixXd>(sampled).householderQ() * Eigen::MatrixXd::Identity(search_points, n);
  functions_ = q.cast<float>();
  root_weight_ = weight.cast<float>();
}

WarpSearch::Scratch WarpSearch::prepare(const RunSampler& run, int first, int last) const {
  Scratch scratch;
  scratch.own =
      run.sample(first, last, Warp(), own_time_points).cast<float>().array().rowwise() * curve_weight_.array();
  scratch.ends = Row::Zero(2, curves_);
  if (pinned_) scratch.ends << scratch.own.topRows(1), scratch.own.bottomRows(1);
  scratch.projection.resize(functions_.cols(), curves_);
  scratch.row.resize(curves_);
  return scratch;
}

double WarpSearch::residual(Scratch& scratch, const Warp& warp) const {
  scratch.projection.setZero();
  double total = 0;
  for (int i = 0; i < search_points; ++i) {
    const double s = static_cast<double>(i) / (search_points - 1);
    const double x = warp.own_time(s) * (own_time_points - 1);
    const auto k = std::min(static_cast<Eigen::Index>(x), static_cast<Eigen::Index>(own_time_points - 2));
    const auto b = static_cast<float>(x - static_cast<double>(k)) * root_weight_(i);
    const float a = root_weight_(i) - b;
    const float to_last = static_cast<float>(s) * root_weight_(i);
    scratch.row = a * scratch.own.row(k) + b * scratch.own.row(k + 1) - mean_(i) * curve_weight_ -
                  (root_weight_(i) - to_last) * scratch.ends.row(0) - to_last * scratch.ends.row(1);
    total += static_cast<double>(scratch.row.squaredNorm());
    for (Eigen::Index f = 0; f < functions_.cols(); ++f) scratch.projection.row(f) += functions_(i, f) * scratch.row;
  }
  const double fine = total - static_cast<double>(scratch.projection.squaredNorm());
  const double coarse = total - static_cast<double>(scratch.projection.topRows(coarse_).squaredNorm());
  // Float sums leave a floor, below which nothing is gained.
  const double floor = 1e-7 * total + 1e-12;
  return std::sqrt(std::max(fine, floor) * std::max(coarse, floor));
}

double WarpSearch::residual(const RunSampler& run, int first, int last, const Warp& warp) const {
  Scratch scratch = prepare(run, first, last);
  return residual(scratch, warp);
}

std::pair<double, Warp> WarpSearch::descend(Scratch& scratch, Warp warp) const {
  double best = residual(scratch, warp);
  for (const int step : {12, 6, 3, 1}) {
    for (bool moved = true; moved;) {
      moved = false;
      for (std::size_t k = 0; k < Warp::terms; ++k) {
        for (const int sign : {-1, 1}) {
          Warp::Coefficients coefficients = warp.coefficients();
          const int value = coefficients[k] + sign * step;
          if (value < -127 || value > 127) continue;
          coefficients[k] = static_cast<std::int8_t>(value);
          if (!Warp::legal(coefficients)) continue;
          const Warp candidate(coefficients);
          const double r = residual(scratch, candidate);
          if (r < best) {
            best = r;
            warp = candidate;
            moved = true;
          }
        }
      }
    }
  }
  return {best, warp};
}

Warp WarpSearch::best(const RunSampler& run, int first, int last, std::span<const Warp> proposals) const {
  if (last - first < 4) return Warp();  // nothing to align
  Scratch scratch = prepare(run, first, last);
  const double plain = residual(scratch, Warp());
  auto [least, warp] = descend(scratch, Warp());
  for (const Warp& proposal : proposals) {
    const auto [r, candidate] = descend(scratch, proposal);
    if (r < least) {
      least = r;
      warp = candidate;
    }
  }
  return least < (1 - options_.least_gain) * plain ? warp : Warp();
}

Eigen::RowVectorXd curve_weights(const Skeleton& skeleton) {
  constexpr double velocity_weight_s = 0.1;  // an error of the velocity lasts about so long before it turns
  const CurveLayout layout = curve_layout(skeleton);
  Eigen::RowVectorXd out(layout.curve_count());
  out.head<3>().setConstant(velocity_weight_s);
  for (int k = 0; k < layout.joint_count(); ++k) {
    const int above = layout.joints[static_cast<std::size_t>(k)];
    std::vector<double> reach(skeleton.joints.size(), -1);  // metres below `above`; negative: not below it
    reach[static_cast<std::size_t>(above)] = 0;
    double squares = 0;
    for (int j = above + 1; j < skeleton.joint_count(); ++j) {
      const Joint& joint = skeleton.joints[static_cast<std::size_t>(j)];
      const double parent = reach[static_cast<std::size_t>(joint.parent)];
      if (parent < 0) continue;
      reach[static_cast<std::size_t>(j)] = parent + joint.offset.norm() / 100;
      squares += reach[static_cast<std::size_t>(j)] * reach[static_cast<std::size_t>(j)];
    }
    out.segment<4>(3 + 4 * k).setConstant(2 * std::sqrt(squares / skeleton.joint_count()));
  }
  return out;
}

TemplateGroups group_sequences(const Eigen::MatrixXf& vectors, int count) {
  TemplateGroups out;
  const Eigen::Index n = vectors.rows();
  out.group.assign(static_cast<std::size_t>(n), 0);
  if (n == 0 || count <= 0) return out;
  const Eigen::RowVectorXf mean = vectors.colwise().mean();
  Eigen::Index next = 0;
  (vectors.rowwise() - mean).rowwise().squaredNorm().minCoeff(&next);
  Eigen::VectorXf nearest = Eigen::VectorXf::Constant(n, std::numeric_limits<float>::infinity());
  for (int t = 0; t < count && t < n; ++t) {
    out.templates.push_back(static_cast<int>(next));
    const Eigen::VectorXf distance = (vectors.rowwise() - vectors.row(next)).rowwise().squaredNorm();
    for (Eigen::Index i = 0; i < n; ++i) {
      if (distance(i) < nearest(i)) {
        nearest(i) = distance(i);
        out.group[static_cast<std::size_t>(i)] = t;
      }
    }
    if (nearest.maxCoeff(&next) <= 0) break;
  }
  return out;
}

Warp warp_of_path(std::span<const FramePair> path, int template_frames, int own_frames) {
  std::array<double, Warp::terms> own_times{};
  std::size_t at = 0;
  for (std::size_t k = 0; k < own_times.size(); ++k) {
    const double wanted = static_cast<double>(k + 1) / (Warp::terms + 1) * (template_frames - 1);
    while (at + 1 < path.size() && path[at].query < wanted) ++at;
    // All own frames matched to that template frame count, so take their middle.
    std::size_t end = at;
    while (end + 1 < path.size() && path[end + 1].query == path[at].query) ++end;
    const double own = (path[at].target + path[end].target) / 2.0;
    own_times[k] = own_frames > 1 ? own / (own_frames - 1) : 0;
  }
  return Warp::through(own_times);
}

}  // namespace kinespace
