#include "kinespace/fpca/motion_space.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/fpca/conditional_scores.h"
#include "kinespace/kernels/covariance.h"
#include "kinespace/kernels/projection.h"

namespace kinespace {
namespace {

// Of what a sequence may lose, the part that functions leave on average, since some sequences need more of them than
// most, and the part that each sequence then leaves out.
constexpr double left_by_functions = 0.1;
constexpr double left_by_a_sequence = 0.5;

FpcaOptions fpca_options(const MotionSpaceOptions& options) {
  FpcaOptions out;
  out.variance_share = 1 - left_by_functions * (1 - options.variance_share);
  out.count = options.functions;
  if (options.smooth) {
    out.variance_share = options.variance_share;  // beyond it there is noise
    out.mean = MeanEstimate::spline;
    out.smooth_covariance = true;
    out.estimate_noise = true;
  }
  return out;
}

// s at the points of the grid.
Eigen::VectorXd times_of(int points) {
  return Eigen::VectorXd::LinSpaced(points, 0, 1);
}

// The straight lines between the ends of curves, T x C.
SampleMatrix lines_between_ends(const SampleMatrix& samples) {
  const Eigen::VectorXd s = times_of(static_cast<int>(samples.rows()));
  SampleMatrix out = s * (samples.bottomRows(1) - samples.topRows(1));
  out.rowwise() += samples.row(0);
  return out;
}

// The two rows of scores that are the ends of the curves.
void write_ends(const SampleMatrix& samples, ScoreMatrix& scores) {
  scores.row(0) = samples.row(0).cast<float>();
  scores.row(1) = samples.row(samples.rows() - 1).cast<float>();
}

// Moments of what curves are above the lines between their ends. That is linear in the curves, B f with
// B = I - (1 - s) e_0' - s e_T', so the moments of the curves themselves say it.
CurveMoments above_the_lines(const CurveMoments& moments) {
  const int points = moments.points();
  const Eigen::VectorXd s = times_of(points);
  Eigen::MatrixXd above = Eigen::MatrixXd::Identity(points, points);
  above.col(0) -= Eigen::VectorXd::Ones(points) - s;
  above.col(points - 1) -= s;
  return {moments.count(), above * moments.mean(), above * moments.scatter() * above.transpose()};
}

// Moments on a device, in float. Of curves y = L e + r, with lines L = [1 - s, s] between their ends e, only the scatter
// of r is left to it: lines carry nearly all of the variance, and its digits would be gone from r.
CurveMoments moments_on_device(const CurveMatrix& block, bool pinned, const Compute& compute) {
  const Eigen::Index points = block.cols();
  CurveMatrix lines(2, points);
  lines.row(1).setLinSpaced(points, 0, 1);
  lines.row(0) = Eigen::RowVectorXd::Ones(points) - lines.row(1);
  CurveMatrix ends = CurveMatrix::Zero(block.rows(), 2);
  if (pinned) ends << block.col(0), block.col(points - 1);
  CurveMatrix above = block - ends * lines;
  const RowMatrix<float> curves = above.cast<float>();
  const CurveCovariance c = covariance(curves, 0, BlockPrecision::single_precision, compute);
  const Eigen::MatrixXd scatter = c.covariance * static_cast<double>(c.count);
  if (!pinned) return {c.count, c.mean, scatter};
  const Eigen::RowVectorXd mean_end = ends.colwise().mean();
  ends.rowwise() -= mean_end;
  above.rowwise() -= c.mean.transpose();
  const Eigen::MatrixXd across = above.transpose() * ends * lines;
  return {c.count, c.mean + (mean_end * lines).transpose(),
          scatter + across + across.transpose() + lines.transpose() * (ends.transpose() * ends) * lines};
}

// On the device when it is one for blocks of this size, else in double here.
void add_block(const CurveMatrix& block, bool pinned, const Compute& compute, CurveMoments& moments) {
  const double flops = static_cast<double>(block.rows()) * static_cast<double>(block.cols() * block.cols());
  if (compute.device_for(KernelFamily::covariance, flops) == nullptr) {
    moments.add(block);
  } else {
    moments.merge(moments_on_device(block, pinned, compute));
  }
}

// Mean over the curves of their mean square distance in time from their common mean.
double variance_of(const CurveMoments& moments, const Eigen::VectorXd& weights) {
  const auto divisor = static_cast<double>(std::max<std::int64_t>(1, moments.count() - 1));
  return weights.dot(moments.scatter().diagonal()) / divisor;
}

// The same of each curve from its own mean in time: trace of W (I - 1 w') (S / n + m m') (I - w 1').
double movement_of(const CurveMoments& moments, const Eigen::VectorXd& weights) {
  if (moments.count() == 0) return 0;
  const Eigen::MatrixXd second =
      moments.scatter() / static_cast<double>(moments.count()) + moments.mean() * moments.mean().transpose();
  return weights.dot(second.diagonal()) - weights.dot(second * weights);
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
  if (!(pace >= 1 && pace <= 100)) fail(fmt::format("pace = {}", pace), "1 to 100");
  if (cycles < 0 || cycles > 8) fail(fmt::format("cycles = {}", cycles), "0 to 8");
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

std::vector<int> MotionSpace::curves_of_group(int group) const {
  std::vector<int> out;
  for (int c = 0; c < curves(); ++c) {
    if (group_of(c) == group) out.push_back(c);
  }
  return out;
}

std::vector<CurveMoments> MotionSpace::empty_moments() const {
  return std::vector<CurveMoments>(static_cast<std::size_t>(group_count()), CurveMoments(points_));
}

void MotionSpace::accumulate(std::span<const SampleMatrix> samples, std::vector<CurveMoments>& moments,
                             const Compute& compute) const {
  assert(moments.size() == static_cast<std::size_t>(group_count()));
  for (int g = 0; g < group_count(); ++g) {
    const std::vector<int> members = curves_of_group(g);
    CurveMatrix block(static_cast<Eigen::Index>(samples.size() * members.size()), points_);
    Eigen::Index row = 0;
    for (const SampleMatrix& s : samples) {
      for (const int c : members) block.row(row++) = s.col(c).transpose();
    }
    add_block(block, options_.pinned, compute, moments[static_cast<std::size_t>(g)]);
  }
}

void MotionSpace::fit(std::vector<CurveMoments> moments, const Compute& compute) {
  groups_.clear();
  FunctionalPcaWorkspace workspace(points_, fpca_options(options_));
  for (const CurveMoments& m : moments) {
    if (m.count() == 0) {
      groups_.push_back({Eigen::VectorXd::Zero(points_), Eigen::MatrixXd(points_, 0), Eigen::VectorXd(), 0, 0});
    } else if (options_.pinned) {
      groups_.push_back(fit_pinned(m));  // without smoothing: nothing for a device
    } else {
      FunctionalPca pca = workspace.fit(m, compute);
      const double variance = pca.all_eigenvalues.cwiseMax(0).sum();
      const double left = variance - pca.eigenvalues.sum();
      groups_.push_back({pca.observed_mean, pca.observed_functions, pca.eigenvalues, variance, left});
      if (pca.noise_variance) groups_.back().expect_scores(*pca.noise_variance);
    }
  }
  moments_ = std::move(moments);
}

// The share of variance that is asked for is of the curves' own, of which the ends take most.
FunctionGroup MotionSpace::fit_pinned(const CurveMoments& moments) const {
  const CurveMoments above = above_the_lines(moments);
  const double variance = variance_of(moments, weights_);
  const double of_functions = variance_of(above, weights_);
  const double may_be_left = left_by_functions * (1 - options_.variance_share) * variance;
  FpcaOptions options = fpca_options(options_);
  if (!options.count && may_be_left >= of_functions) options.count = 0;
  if (!options.count) options.variance_share = std::max(1e-12, 1 - may_be_left / of_functions);
  FunctionalPca pca = FunctionalPcaWorkspace(points_, options).fit(above);
  const double left = pca.all_eigenvalues.cwiseMax(0).sum() - pca.eigenvalues.sum();
  return {pca.observed_mean, pca.observed_functions, pca.eigenvalues, variance, left};
}

void FunctionGroup::expect_scores(double noise_variance) {
  noise = noise_variance;
  conditional = ConditionalScores(functions, eigenvalues, static_cast<int>(eigenvalues.size())).projection(*noise);
}

ScoreMatrix MotionSpace::scores(const SampleMatrix& samples, const Compute& compute) const {
  return std::move(scores(std::span(&samples, 1), compute).front());
}

std::vector<ScoreMatrix> MotionSpace::scores(std::span<const SampleMatrix> samples, const Compute& compute) const {
  const auto count = static_cast<double>(samples.size());
  const double flops = 2.0 * count * points_ * curves() * functions();
  if (flops > 0 && compute.device_for(KernelFamily::projection, flops) != nullptr) {
    return scores_on_device(samples, compute);
  }
  std::vector<ScoreMatrix> out(samples.size());
  parallel_for(std::size_t{0}, samples.size(),
               [&](std::size_t i) { out[i] = scores_by(ScoreKind::conditional, samples[i]); });
  return out;
}

// Conditional ones where the space has them.
ScoreMatrix MotionSpace::scores_by(ScoreKind kind, const SampleMatrix& samples) const {
  assert(samples.rows() == points_ && samples.cols() == curves());
  ScoreMatrix out = ScoreMatrix::Zero(rows(), curves());
  SampleMatrix above;  // what functions describe, where it is not the samples themselves
  if (options_.pinned) {
    write_ends(samples, out);
    above = samples - lines_between_ends(samples);
  }
  const SampleMatrix& curves_of = options_.pinned ? above : samples;
  auto of_functions = out.bottomRows(functions());
  if (groups_.size() == 1) {
    const FunctionGroup& g = groups_.front();
    const bool expected = g.noise && kind == ScoreKind::conditional;
    Eigen::MatrixXd projector = (g.functions.array().colwise() * weights_.array()).matrix();
    if (expected) projector = g.conditional.transpose();
    const SampleMatrix centred = curves_of.colwise() - g.mean;
    of_functions = (projector.transpose() * centred).cast<float>();
    return out;
  }
  for (int c = 0; c < curves(); ++c) {
    const FunctionGroup& g = groups_[static_cast<std::size_t>(group_of(c))];
    const Eigen::VectorXd centred = curves_of.col(c) - g.mean;
    const bool expected = g.noise && kind == ScoreKind::conditional;
    auto out_of_curve = of_functions.col(c).head(g.functions.cols());
    if (expected) {
      out_of_curve = (g.conditional * centred).cast<float>();
    } else {
      out_of_curve = (g.functions.transpose() * centred.cwiseProduct(weights_)).cast<float>();
    }
  }
  return out;
}

void MotionSpace::drop_needless(ScoreMatrix& scores) const {
  if (options_.functions || options_.smooth) return;
  const int ends = options_.pinned ? 2 : 0;
  double variance = 0;  // of all curves of a sequence
  for (int c = 0; c < curves(); ++c) variance += groups_[static_cast<std::size_t>(group_of(c))].variance;
  double may_go = left_by_a_sequence * (1 - options_.variance_share) * variance;
  for (Eigen::Index row = scores.rows(); row-- > ends;) {
    may_go -= scores.row(row).cast<double>().squaredNorm();
    if (may_go < 0) return;
    scores.row(row).setZero();
  }
}

std::vector<ScoreMatrix> MotionSpace::scores_on_device(std::span<const SampleMatrix> samples,
                                                       const Compute& compute) const {
  std::vector<ScoreMatrix> out(samples.size(), ScoreMatrix::Zero(rows(), curves()));
  const Eigen::Index ends = rows() - functions();
  for (int group = 0; group < group_count(); ++group) {
    const std::vector<int> members = curves_of_group(group);
    const FunctionGroup& g = groups_[static_cast<std::size_t>(group)];
    RowMatrix<float> curves(static_cast<Eigen::Index>(samples.size() * members.size()), points_);
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      assert(samples[i].rows() == points_ && samples[i].cols() == this->curves());
      if (options_.pinned && group == 0) write_ends(samples[i], out[i]);
      const SampleMatrix lines = options_.pinned ? lines_between_ends(samples[i]) : SampleMatrix();
      for (const int c : members) {
        curves.row(row) = samples[i].col(c).transpose().cast<float>();
        if (options_.pinned) curves.row(row) = (samples[i].col(c) - lines.col(c)).transpose().cast<float>();
        ++row;
      }
    }
    RowMatrix<float> projector = (g.functions.array().colwise() * weights_.array()).matrix().cast<float>();
    if (g.noise) projector = g.conditional.transpose().cast<float>();
    const RowMatrix<float> found = project(curves, g.mean.cast<float>(), projector, compute);
    row = 0;
    for (ScoreMatrix& scores : out) {
      for (const int c : members) scores.col(c).segment(ends, found.cols()) = found.row(row++).transpose();
    }
  }
  return out;
}

void MotionSpace::add_ends(const ScoreMatrix& scores, SampleMatrix& samples) const {
  const Eigen::RowVectorXd first = scores.row(0).cast<double>();
  const Eigen::RowVectorXd change = scores.row(1).cast<double>() - first;
  samples.noalias() += times_of(points_) * change;
  samples.rowwise() += first;
}

SampleMatrix MotionSpace::samples(const ScoreMatrix& scores, int n) const {
  const int ends = options_.pinned ? 2 : 0;
  const int kept = rows_at(n);
  const int of_functions = std::max(0, kept - ends);
  SampleMatrix out(points_, curves());
  if (groups_.size() == 1) {
    const FunctionGroup& g = groups_.front();
    out.noalias() = g.functions.leftCols(of_functions) * scores.middleRows(ends, of_functions).cast<double>();
    out.colwise() += g.mean;
  } else {
    for (int c = 0; c < curves(); ++c) {
      const FunctionGroup& g = groups_[static_cast<std::size_t>(group_of(c))];
      const Eigen::Index k = std::min<Eigen::Index>(of_functions, g.functions.cols());
      out.col(c) = g.mean + g.functions.leftCols(k) * scores.col(c).segment(ends, k).cast<double>();
    }
  }
  if (options_.pinned && kept > 0) add_ends(scores, out);
  return out;
}

ScoreMatrix MotionSpace::transfer(const ScoreMatrix& scores, const MotionSpace& from) const {
  assert(from.points_ == points_ && from.curves() == curves());
  // What was reconstructed holds no noise any more: integrals say it exactly.
  return scores_by(ScoreKind::integration, from.samples(scores));
}

Eigen::VectorXd MotionSpace::truncation_error(const ScoreMatrix& scores, int n) const {
  const int rest = rows() - rows_at(n);
  return scores.bottomRows(rest).cast<double>().colwise().norm().transpose();
}

int MotionSpace::functions() const {
  Eigen::Index most = 0;
  for (const FunctionGroup& g : groups_) most = std::max(most, g.functions.cols());
  return static_cast<int>(most);
}

int MotionSpace::rows() const {
  return functions() + (options_.pinned ? 2 : 0);
}

int MotionSpace::rows_at(int n) const {
  if (n < 0) return rows();
  constexpr double rounding = 1e-9;
  const double numbers = std::ceil(n * options_.pace - rounding);  // a curve
  const double wanted = options_.pinned ? std::max(2.0, numbers + 1) : numbers;
  return static_cast<int>(std::min(static_cast<double>(rows()), wanted));
}

int MotionSpace::levels() const {
  int level = options_.pinned ? 1 : 0;
  while (rows_at(level) < rows()) ++level;
  return level;
}

int MotionSpace::function_count() const {
  Eigen::Index sum = 0;
  for (const FunctionGroup& g : groups_) sum += g.functions.cols();
  return static_cast<int>(sum);
}

double MotionSpace::variance_covered() const {
  double left = 0;
  double all = 0;
  for (const FunctionGroup& g : groups_) {
    left += g.left;
    all += g.variance;
  }
  return all > 0 ? 1 - left / all : 1;
}

double MotionSpace::movement_covered() const {
  double left = 0;
  double all = 0;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    left += groups_[g].left;
    all += movement_of(moments_[g], weights_);
  }
  return all > 0 ? 1 - left / all : 1;
}

}  // namespace kinespace
