#include "kinespace/fpca/motion_space.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/kernels/covariance.h"
#include "kinespace/kernels/projection.h"

namespace kinespace {
namespace {

FpcaOptions fpca_options(const MotionSpaceOptions& options) {
  FpcaOptions out;
  out.variance_share = options.variance_share;
  out.count = options.functions;
  if (options.smooth) {
    out.mean = MeanEstimate::smooth;
    out.smooth_covariance = true;
    out.estimate_noise = true;
  }
  return out;
}

// On the device when it is one for blocks of this size, else in double here.
void add_block(const CurveMatrix& block, const Compute& compute, CurveMoments& moments) {
  const double flops = static_cast<double>(block.rows()) * static_cast<double>(block.cols() * block.cols());
  if (compute.device_for(KernelFamily::covariance, flops) == nullptr) {
    moments.add(block);
    return;
  }
  const RowMatrix<float> curves = block.cast<float>();
  const CurveCovariance c = covariance(curves, 0, BlockPrecision::single_precision, compute);
  moments.merge(CurveMoments(c.count, c.mean, c.covariance * static_cast<double>(c.count)));
}

}  // namespace

void MotionSpaceOptions::validate() const {
  const auto fail = [](const std::string& found, const char* expected) {
    throw Error(ErrorKind::usage, {.found = found, .expected = expected});
  };
  if (points != 0 && (points < 4 || points > 1024))
    fail(fmt::format("points = {}", points), "0 (automatic) or 4 to 1024");
  if (!(variance_share > 0 && variance_share <= 1)) {
    fail(fmt::format("variance_share = {}", variance_share), "a share above 0, up to 1");
  }
  if (functions && (*functions < 1 || *functions > 1024)) fail(fmt::format("functions = {}", *functions), "1 to 1024");
}

MotionSpace::MotionSpace(Skeleton skeleton, MotionSpaceOptions options, int points)
    : skeleton_(std::move(skeleton)),
      layout_(curve_layout(skeleton_)),
      options_(options),
      points_(points),
      weights_(trapezoid_weights(points, 1.0)),
      references_(Eigen::Matrix4Xd::Zero(4, layout_.joint_count())) {
  options_.validate();
  references_.row(0).setOnes();
}

void MotionSpace::set_references(const Eigen::Matrix4Xd& references) {
  assert(references.cols() == layout_.joint_count());
  references_ = references;
}

void MotionSpace::apply_references(SampleMatrix& values) const {
  const Eigen::RowVectorXd signs = reference_signs(values);
  for (int k = 0; k < layout_.joint_count(); ++k) {
    if (signs(3 + 4 * k) < 0) values.middleCols(3 + 4 * k, 4) *= -1;
  }
}

Eigen::RowVectorXd MotionSpace::reference_signs(const SampleMatrix& values) const {
  Eigen::RowVectorXd signs = Eigen::RowVectorXd::Ones(curves());
  for (int k = 0; k < layout_.joint_count(); ++k) {
    const auto q = values.middleCols(3 + 4 * k, 4);
    const Eigen::RowVector4d side = references_.col(k).transpose();
    const double dot = k == 0 ? q.row(0).dot(side) : (q * side.transpose()).sum();
    if (dot < 0) signs.segment<4>(3 + 4 * k).setConstant(-1);
  }
  return signs;
}

int MotionSpace::group_count() const {
  switch (options_.grouping) {
    case Grouping::all_together:
      return 1;
    case Grouping::per_component:
      return 7;
    case Grouping::per_joint_component:
      return curves();
  }
  return 1;
}

int MotionSpace::group_of(int curve) const {
  switch (options_.grouping) {
    case Grouping::all_together:
      return 0;
    case Grouping::per_component:
      return CurveLayout::component(curve);
    case Grouping::per_joint_component:
      return curve;
  }
  return 0;
}

std::vector<CurveMoments> MotionSpace::empty_moments() const {
  return std::vector<CurveMoments>(static_cast<std::size_t>(group_count()), CurveMoments(points_));
}

void MotionSpace::accumulate(std::span<const SampleMatrix> samples, std::vector<CurveMoments>& moments,
                             const Compute& compute) const {
  assert(moments.size() == static_cast<std::size_t>(group_count()));
  std::vector<int> members;
  for (int g = 0; g < group_count(); ++g) {
    members.clear();
    for (int c = 0; c < curves(); ++c) {
      if (group_of(c) == g) members.push_back(c);
    }
    CurveMatrix block(static_cast<Eigen::Index>(samples.size() * members.size()), points_);
    Eigen::Index row = 0;
    for (const SampleMatrix& s : samples) {
      for (const int c : members) block.row(row++) = s.col(c).transpose();
    }
    add_block(block, compute, moments[static_cast<std::size_t>(g)]);
  }
}

void MotionSpace::fit(std::vector<CurveMoments> moments) {
  groups_.clear();
  FunctionalPcaWorkspace workspace(points_, fpca_options(options_));
  for (const CurveMoments& m : moments) {
    FunctionalPca pca = workspace.fit(m);
    FunctionGroup group;
    group.mean = pca.observed_mean;
    group.functions = pca.observed_functions;
    group.eigenvalues = pca.eigenvalues;
    group.variance = pca.all_eigenvalues.cwiseMax(0).sum();
    groups_.push_back(std::move(group));
  }
  moments_ = std::move(moments);
}

ScoreMatrix MotionSpace::scores(const SampleMatrix& samples, const Compute& compute) const {
  assert(samples.rows() == points_ && samples.cols() == curves());
  ScoreMatrix out = ScoreMatrix::Zero(functions(), curves());
  if (groups_.size() == 1) {
    const FunctionGroup& g = groups_.front();
    const Eigen::MatrixXd projector = (g.functions.array().colwise() * weights_.array()).matrix();
    const double flops = 2.0 * static_cast<double>(projector.size()) * curves();
    if (compute.device_for(KernelFamily::projection, flops) != nullptr) {
      const RowMatrix<float> rows = samples.transpose().cast<float>();
      const RowMatrix<float> matrix = projector.cast<float>();
      return project(rows, g.mean.cast<float>(), matrix, compute).transpose();
    }
    const SampleMatrix centred = samples.colwise() - g.mean;
    out = (projector.transpose() * centred).cast<float>();
    return out;
  }
  for (int c = 0; c < curves(); ++c) {
    const FunctionGroup& g = groups_[static_cast<std::size_t>(group_of(c))];
    const Eigen::VectorXd weighted = (samples.col(c) - g.mean).cwiseProduct(weights_);
    out.col(c).head(g.functions.cols()) = (g.functions.transpose() * weighted).cast<float>();
  }
  return out;
}

SampleMatrix MotionSpace::samples(const ScoreMatrix& scores, int n) const {
  if (n < 0 || n > functions()) n = functions();
  if (groups_.size() == 1) {
    const FunctionGroup& g = groups_.front();
    SampleMatrix out = g.functions.leftCols(n) * scores.topRows(n).cast<double>();
    out.colwise() += g.mean;
    return out;
  }
  SampleMatrix out(points_, curves());
  for (int c = 0; c < curves(); ++c) {
    const FunctionGroup& g = groups_[static_cast<std::size_t>(group_of(c))];
    const Eigen::Index k = std::min<Eigen::Index>(n, g.functions.cols());
    out.col(c) = g.mean + g.functions.leftCols(k) * scores.col(c).head(k).cast<double>();
  }
  return out;
}

ScoreMatrix MotionSpace::transfer(const ScoreMatrix& scores, const MotionSpace& from) const {
  assert(from.points_ == points_ && from.curves() == curves());
  return this->scores(from.samples(scores));
}

Eigen::VectorXd MotionSpace::truncation_error(const ScoreMatrix& scores, int n) const {
  const int rest = std::max(0, functions() - std::max(n, 0));
  return scores.bottomRows(rest).cast<double>().colwise().norm().transpose();
}

int MotionSpace::functions() const {
  Eigen::Index most = 0;
  for (const FunctionGroup& g : groups_) most = std::max(most, g.functions.cols());
  return static_cast<int>(most);
}

int MotionSpace::function_count() const {
  Eigen::Index sum = 0;
  for (const FunctionGroup& g : groups_) sum += g.functions.cols();
  return static_cast<int>(sum);
}

double MotionSpace::variance_covered() const {
  double covered = 0;
  double all = 0;
  for (const FunctionGroup& g : groups_) {
    covered += g.eigenvalues.sum();
    all += g.variance;
  }
  return all > 0 ? covered / all : 1;
}

}  // namespace kinespace
