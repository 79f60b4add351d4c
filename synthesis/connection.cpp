#include "kinespace/synthesis/connection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/fpca/alignment.h"
#include "kinespace/synthesis/detail/connection_cost.h"
#include "kinespace/synthesis/detail/connection_refinement.h"

namespace kinespace {
using namespace connections;

namespace {

constexpr int fine_points = 1025;
constexpr int function_points = 129;
constexpr int points_per_cell = 4;
constexpr int stretch_points = bound_cells * points_per_cell + 1;  // a stretch is scored at so many points
constexpr double least_overlap = 0.1;                              // |S| that is tabulated
constexpr int scales_per_octave = 4;
constexpr double shift_steps = 40;  // per unit of the faster clock
constexpr int minima_refined = 8;
constexpr double worth_refining = 2;  // cells that cost so many times the best are left

// From the points of a set to those of the `number`-th of `stretches` equal stretches of its time, by straight lines.
Eigen::MatrixXd cut_out(Eigen::Index from, Eigen::Index to, int number, int stretches) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(to, from);
  for (Eigen::Index i = 0; i < to; ++i) {
    const double s = (number + static_cast<double>(i) / static_cast<double>(to - 1)) / stretches;
    const double x = s * static_cast<double>(from - 1);
    const auto cell = std::min(static_cast<Eigen::Index>(x), from - 2);
    out(i, cell) = 1 - (x - static_cast<double>(cell));
    out(i, cell + 1) = x - static_cast<double>(cell);
  }
  return out;
}

// Moments of all motion of a space by the second or so: sequences that last longer count as several.
CurveMoments moments_by_second(const RegisteredSpace& space, std::size_t group) {
  CurveMoments all(space.plain().points());
  for (const MotionSpace& set : space.sets()) {
    if (!space.has(set.options().cycles) || set.moments()[group].count() == 0) continue;
    const CurveMoments& moments = set.moments()[group];
    const int stretches = static_cast<int>(std::lround(set.options().pace));
    for (int i = 0; i < stretches; ++i) {
      const Eigen::MatrixXd part = cut_out(set.points(), space.plain().points(), i, stretches);
      all.merge({moments.count(), part * moments.mean(), part * moments.scatter() * part.transpose()});
    }
  }
  return all;
}

// Mean and functions of the curves as they are: those of a pinned space vanish at the ends, and windows do not.
SampleMatrix mean_and_functions(const RegisteredSpace& space, int count) {
  const auto& groups = space.plain().groups();
  const auto group = std::ranges::max_element(groups, {}, &FunctionGroup::variance);
  Eigen::MatrixXd functions = group->functions;
  Eigen::VectorXd mean = group->mean;
  if (space.options().pinned) {
    const CurveMoments moments = moments_by_second(space, static_cast<std::size_t>(group - groups.begin()));
    const FpcaOptions options{.variance_share = space.options().variance_share};
    FunctionalPca pca = FunctionalPcaWorkspace(moments.points(), options).fit(moments);
    functions = std::move(pca.observed_functions);
    mean = std::move(pca.observed_mean);
  }
  const auto kept = std::min<Eigen::Index>(count, functions.cols());
  SampleMatrix out(mean.size(), kept + 1);
  out << mean, functions.leftCols(kept);
  return out;
}

// What motions can be scored in: an orthonormal basis (trapezoid rule) of the span of 1, the mean and the functions.
SampleMatrix orthonormal_functions(const RegisteredSpace& space, int count) {
  const SampleMatrix found = mean_and_functions(space, count - 2);
  const Eigen::Index wanted = found.cols() + 1;
  SampleMatrix columns(found.rows(), wanted);
  columns.col(0).setOnes();
  columns.rightCols(wanted - 1) = found;
  const UniformSpline spline(std::move(columns));
  SampleMatrix at(function_points, wanted);
  for (int i = 0; i < function_points; ++i) {
    spline.value(i * static_cast<double>(found.rows() - 1) / (function_points - 1), at.row(i));
  }
  const Eigen::VectorXd root = trapezoid_weights(function_points, 1.0).cwiseSqrt();
  const Eigen::MatrixXd scaled = root.asDiagonal() * at;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(scaled);
  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(function_points, wanted);
  return root.cwiseInverse().asDiagonal() * q;
}

// Metres per unit of each invariant curve.
Eigen::RowVectorXd invariant_weights(const Skeleton& skeleton) {
  const Eigen::RowVectorXd weights = curve_weights(skeleton);
  Eigen::RowVectorXd out(InvariantPose::size(weights.size()));
  out.head<3>() = weights.head<3>();
  out(3) = weights(0) * weights(3) / 2;  // a turn moves the joints by half of what its quaternion's weight says
  out(InvariantPose::height) = 1;
  out.tail(weights.size() - 3) = weights.tail(weights.size() - 3);
  return out;
}

Eigen::RowVectorXd invariant_reference(const RegisteredSpace& space) {
  Eigen::RowVectorXd out = Eigen::RowVectorXd::Zero(InvariantPose::size(space.curves()));
  out(InvariantPose::rotations) = 1;
  for (Eigen::Index j = 1; j < space.references().cols(); ++j) {
    out.segment<4>(InvariantPose::rotations + 4 * j) = space.references().col(j).transpose();
  }
  return out;
}

// The poses in the middle of the cells of a stretch, and how far the motion gets from them within a cell.
void add_poses(const SampleMatrix& curves, ConnectionMotion& motion) {
  motion.poses.resize(bound_cells, curves.cols());
  motion.spread.resize(bound_cells);
  for (int i = 0; i < bound_cells; ++i) {
    const Eigen::Index middle = i * points_per_cell + points_per_cell / 2;
    motion.poses.row(i) = curves.row(middle).cast<float>();
    motion.spread(i) =
        static_cast<float>((curves.middleRows(i * points_per_cell, points_per_cell + 1).rowwise() - curves.row(middle))
                               .rowwise()
                               .norm()
                               .maxCoeff());
  }
}

}  // namespace

void ConnectionOptions::validate() const {
  const auto fail = [](const std::string& found, const std::string& expected) {
    throw Error(ErrorKind::usage, {.found = found, .expected = expected});
  };
  if (!(window_s > 0.1 && window_s <= 20)) fail(fmt::format("window_s = {}", window_s), "above 0.1, up to 20");
  if (!(shortest_s >= 0.1 && shortest_s <= window_s)) {
    fail(fmt::format("shortest_s = {}", shortest_s), "from 0.1 to window_s");
  }
  if (functions < 4 || functions > most_functions)
    fail(fmt::format("functions = {}", functions), fmt::format("from 4 to {}", most_functions));
}

ConnectionSpace::ConnectionSpace(const RegisteredSpace& space, const ConnectionOptions& options)
    : ConnectionSpace(space, orthonormal_functions(space, options.functions), options) {}

ConnectionSpace::ConnectionSpace(const RegisteredSpace& space, SampleMatrix functions, const ConnectionOptions& options)
    : options_(options),
      weights_(invariant_weights(space.skeleton())),
      reference_(invariant_reference(space)),
      functions_(std::move(functions)) {
  options_.validate();
  tabulate();
}

void ConnectionSpace::tabulate() {
  const auto count = functions_.cols();
  const UniformSpline spline(functions_);
  SampleMatrix fine(fine_points, count);
  for (int i = 0; i < fine_points; ++i) {
    spline.value(i * static_cast<double>(functions_.rows() - 1) / (fine_points - 1), fine.row(i));
  }
  fine_ = fine.cast<float>();
  curves_ = std::make_shared<const FunctionCurves>(functions_);

  const Eigen::Index packed = count * (count + 1) / 2;
  Eigen::MatrixXf of_first(count, overlap_points), of_second(count, overlap_points);
  const int most = static_cast<int>(scale_octaves) * scales_per_octave;
  for (int k = -most; k <= most; ++k) {
    Cells cells{.u = std::exp2(static_cast<double>(k) / scales_per_octave)};
    const Interval range = shifts_for(cells.u, least_overlap * std::max(1.0, 1 / cells.u));
    const double step = std::max(1.0, cells.u) / shift_steps;
    for (double v = range.begin; v <= range.end; v += step) cells.shifts.push_back(v);
    cells.grams.resize(static_cast<Eigen::Index>(cells.shifts.size()), 2 * packed + count * count);
    for (std::size_t i = 0; i < cells.shifts.size(); ++i) {
      const Interval s = overlap_of(cells.u, cells.shifts[i]);
      cells.overlaps.push_back(s.length());
      for (int p = 0; p < overlap_points; ++p) {
        const double at = s.begin + s.length() * (p + 0.5) / overlap_points;
        interpolate(cells.u * at + cells.shifts[i], of_first.col(p).data());
        interpolate(at, of_second.col(p).data());
      }
      const Eigen::MatrixXf p_form = of_first * of_first.transpose() / overlap_points;
      const Eigen::MatrixXf q_form = of_first * of_second.transpose() / overlap_points;
      const Eigen::MatrixXf w_form = of_second * of_second.transpose() / overlap_points;
      auto row = cells.grams.row(static_cast<Eigen::Index>(i));
      Eigen::Index at = 0;
      for (const auto* form : {&p_form, &w_form}) {
        for (Eigen::Index c = 0; c < count; ++c) {
          for (Eigen::Index r = 0; r <= c; ++r) row(at++) = (r == c ? 1.0F : 2.0F) * (*form)(r, c);
        }
      }
      for (Eigen::Index c = 0; c < count; ++c) {
        for (Eigen::Index r = 0; r < count; ++r) row(at++) = -2.0F * q_form(r, c);
      }
    }
    if (!cells.shifts.empty()) table_.push_back(std::move(cells));
  }
}

void ConnectionSpace::interpolate(double x, float* out, Eigen::Index step) const {
  const double at = std::clamp(x, 0.0, 1.0) * (fine_points - 1);
  const auto i = std::min(static_cast<Eigen::Index>(at), static_cast<Eigen::Index>(fine_points - 2));
  const auto b = static_cast<float>(at - static_cast<double>(i));
  const float* low = fine_.row(i).data();
  const float* high = low + fine_.cols();
  for (Eigen::Index k = 0; k < fine_.cols(); ++k) out[k * step] = (1 - b) * low[k] + b * high[k];
}

ConnectionMotion ConnectionSpace::stretch_of(const CurveSampler& clip, double start_s, double length_s) const {
  SampleMatrix poses(stretch_points, weights_.size());
  for (int i = 0; i < stretch_points; ++i) {
    invariant_pose(clip, start_s + length_s * i / (stretch_points - 1), poses.row(i));
  }
  poses = ((poses.rowwise() - reference_).array().rowwise() * weights_.array()).matrix();
  SampleMatrix functions(stretch_points, functions_.cols());
  for (int i = 0; i < stretch_points; ++i) {
    Eigen::RowVectorXf row(functions_.cols());
    interpolate(static_cast<double>(i) / (stretch_points - 1), row.data());
    functions.row(i) = row.cast<double>();
  }
  // Least squares rather than plain integrals: the grid of a stretch is coarser than that of the functions.
  const Eigen::MatrixXd weighted = trapezoid_weights(stretch_points, 1.0).asDiagonal() * functions;
  const Eigen::MatrixXd scores = (weighted.transpose() * functions).ldlt().solve(weighted.transpose() * poses);

  ConnectionMotion out{.start_s = start_s, .length_s = length_s, .scores = scores.cast<float>()};
  const SampleMatrix curves = functions * scores;
  add_poses(curves.rightCols(weights_.size() - InvariantPose::rates), out);
  const Eigen::MatrixXd rates = out.scores.leftCols(InvariantPose::rates).cast<double>();
  const Eigen::MatrixXd rest = out.scores.rightCols(weights_.size() - InvariantPose::rates).cast<double>();
  out.rates = rates * rates.transpose();
  out.rest = rest * rest.transpose();
  return out;
}

ConnectionMotion ConnectionSpace::end_of(const ClipCurves& clip) const {
  const CurveSampler sampler(clip);
  const double length = std::min(options_.window_s, sampler.duration_s() / 2);
  return stretch_of(sampler, sampler.duration_s() - length, length);
}

ConnectionMotion ConnectionSpace::start_of(const ClipCurves& clip) const {
  const CurveSampler sampler(clip);
  return stretch_of(sampler, 0, std::min(options_.window_s, sampler.duration_s() / 2));
}

double ConnectionSpace::cost(const ConnectionMotion& first, const ConnectionMotion& second, double u, double v,
                             double shortest_s) const {
  constexpr double rounding = 1e-9;
  const double shortest = shortest_s > 0 ? shortest_s : options_.shortest_s;
  if (!(u > 0) || !legal_speed(speed_of(first, second, u))) return infinite;
  if (overlap_of(u, v).length() < least_overlap_of(first, second, u, shortest) - rounding) return infinite;
  return PairCost(*curves_, first, second)(u, v);
}

struct ConnectionSpace::Minimum {
  double cost = 0;
  double log_u = 0, v = 0;
  double share = 0;  // of the way over the legal shifts
};

// The minima of the table along the shift, for every legal scale, lowest first.
std::vector<ConnectionSpace::Minimum> ConnectionSpace::minima_of_table(const PairCost& cost,
                                                                       const LegalRange& range) const {
  const Interval scales = range.scales();
  const auto count = functions_.cols();
  const Eigen::MatrixXd second_own = range.second->rates + range.second->rest;
  std::vector<Minimum> minima;
  Eigen::VectorXf form(count * (count + 1) + count * count), costs;
  for (const Cells& cells : table_) {
    const double log_u = std::log2(cells.u);
    if (log_u < scales.begin - 1e-9 || log_u > scales.end + 1e-9) continue;
    const Interval legal = range.shifts(log_u);
    const auto begin = std::ranges::lower_bound(cells.shifts, legal.begin) - cells.shifts.begin();
    const auto end = std::ranges::upper_bound(cells.shifts, legal.end) - cells.shifts.begin();
    const double middle = (legal.begin + legal.end) / 2;
    if (begin == end) minima.push_back({infinite, log_u, middle, 0.5});  // a range between two cells

    const double speed = speed_of(*range.first, *range.second, cells.u);
    const Eigen::MatrixXd first_own = speed * speed * range.first->rates + range.first->rest;
    Eigen::Index at = 0;
    for (const auto* own : {&first_own, &second_own}) {
      for (Eigen::Index c = 0; c < count; ++c, at += c) {
        form.segment(at, c + 1) = own->col(c).head(c + 1).cast<float>();
      }
    }
    const Eigen::MatrixXd cross = speed * cost.cross_rates() + cost.cross_rest();
    form.tail(count * count) = cross.reshaped().cast<float>();
    costs = cells.grams.middleRows(begin, end - begin) * form;
    for (Eigen::Index i = 0; i < costs.size(); ++i) {
      const bool lowest = (i == 0 || costs(i) <= costs(i - 1)) && (i + 1 == costs.size() || costs(i) <= costs(i + 1));
      if (!lowest) continue;
      const double v = cells.shifts[static_cast<std::size_t>(begin + i)];
      const double share = (v - legal.begin) / std::max(legal.length(), 1e-12);
      minima.push_back({costs(i), log_u, v, std::clamp(share, 0.0, 1.0)});
    }
  }
  if (minima.empty()) {  // a range of scales between two of the table
    if (scales.begin <= scales.end) {
      const double log_u = std::clamp(range.even(), scales.begin, scales.end);
      const Interval legal = range.shifts(log_u);
      minima.push_back({infinite, log_u, (legal.begin + legal.end) / 2, 0.5});
    }
  }
  std::ranges::stable_sort(minima, {}, &Minimum::cost);
  return minima;
}

std::optional<Connection> ConnectionSpace::connect(const ConnectionMotion& first, const ConnectionMotion& second,
                                                   double shortest_s, const Limits& limits) const {
  const LegalRange range{&first, &second, shortest_s > 0 ? shortest_s : options_.shortest_s, limits.largest_speed};
  const PairCost cost(*curves_, first, second);
  const std::vector<Minimum> minima = minima_of_table(cost, range);
  if (minima.empty()) return std::nullopt;
  constexpr double worth_looking = 1.4;
  const double least = minima.front().cost;
  if (std::isfinite(least) && 100 * std::sqrt(std::max(least, 0.0)) > worth_looking * limits.give_up_cm)
    return std::nullopt;

  RefinedConnection best;
  int evaluations = 0;
  std::vector<const Minimum*> tried;
  for (const Minimum& start : minima) {
    if (tried.size() == minima_refined || (std::isfinite(start.cost) && start.cost > worth_refining * least)) break;
    const bool near = std::ranges::any_of(tried, [&](const Minimum* other) {
      return std::abs(other->log_u - start.log_u) < 0.6 && std::abs(other->share - start.share) < 0.06;
    });
    if (near) continue;
    tried.push_back(&start);
    const RefinedConnection found = refine(cost, range, start.log_u, start.v, options_.minimiser);
    evaluations += found.evaluations;
    if (found.cost < best.cost) best = found;
  }
  if (best.cost == infinite) return std::nullopt;

  Connection out{.scale = std::exp2(best.log_u),
                 .shift = best.v,
                 .cost_cm = 100 * std::sqrt(std::max(best.cost, 0.0)),
                 .evaluations = evaluations};
  const Interval s = overlap_of(out.scale, out.shift);
  out.leave_s = first.start_s + first.length_s * (out.scale * s.begin + out.shift);
  out.left_s = first.start_s + first.length_s * (out.scale * s.end + out.shift);
  out.enter_s = second.start_s + second.length_s * s.begin;
  out.entered_s = second.start_s + second.length_s * s.end;
  return out;
}

namespace {

constexpr int cells = connections::bound_cells;
constexpr int axes = 16;

// The least mean of values over stretches that last at least `length` cells. Within a cell the best border of a stretch
// is a border of the cell, so stretches of whole cells do, up to two cells shorter.
float least_mean(const Eigen::Matrix<float, cells, 1>& values, double length) {
  const int shortest = std::clamp(static_cast<int>(std::ceil(length)) - 2, 1, cells);
  std::array<float, cells + 1> sums{};
  for (int i = 0; i < cells; ++i) sums[static_cast<std::size_t>(i) + 1] = sums[static_cast<std::size_t>(i)] + values(i);
  float least = std::numeric_limits<float>::max();
  for (int begin = 0; begin + shortest <= cells; ++begin) {
    // A stretch of twice the length has a half that is no worse.
    for (int count = shortest; count < 2 * shortest && begin + count <= cells; ++count) {
      const float sum = sums[static_cast<std::size_t>(begin + count)] - sums[static_cast<std::size_t>(begin)];
      least = std::min(least, sum / static_cast<float>(count));
    }
  }
  return least;
}

}  // namespace

ConnectionBounds::ConnectionBounds(const ConnectionOptions& options, std::span<const ConnectionMotion* const> firsts,
                                   std::span<const ConnectionMotion* const> seconds)
    : shortest_s_(options.shortest_s) {
  if (firsts.empty() || seconds.empty()) return;
  const Eigen::Index curves = firsts[0]->poses.cols();
  Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(curves);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(curves, curves);
  double count = 0;
  for (const auto& group : {firsts, seconds}) {
    for (const ConnectionMotion* motion : group) {
      const Eigen::RowVectorXd pose = motion->poses.colwise().mean().cast<double>();
      mean += pose;
      covariance += pose.transpose() * pose;
      count += 1;
    }
  }
  mean /= count;
  covariance = covariance / count - mean.transpose() * mean;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  const Eigen::Index kept = std::min<Eigen::Index>(axes, curves);
  const Eigen::MatrixXf basis = solver.eigenvectors().rightCols(kept).cast<float>();
  const Eigen::RowVectorXf centre = mean.cast<float>();

  const auto tracks = [&](std::span<const ConnectionMotion* const> motions, std::vector<Track>& out) {
    out.resize(motions.size());
    parallel_for(std::size_t{0}, motions.size(), [&](std::size_t i) {
      const Eigen::MatrixXf poses = motions[i]->poses.rowwise() - centre;
      Track& track = out[i];
      track.length_s = motions[i]->length_s;
      track.spread = motions[i]->spread;
      track.poses.resize(kept + 1, cells);
      track.poses.topRows(kept) = (poses * basis).transpose();
      const Eigen::VectorXf left =
          poses.rowwise().squaredNorm() - track.poses.topRows(kept).colwise().squaredNorm().transpose();
      track.poses.row(kept) = left.cwiseMax(0).cwiseSqrt().transpose();
      track.squares = track.poses.colwise().squaredNorm().transpose();
    });
  };
  tracks(firsts, firsts_);
  tracks(seconds, seconds_);
}

double ConnectionBounds::cm(std::size_t first, std::size_t second) const {
  const Track& a = firsts_[first];
  const Track& b = seconds_[second];
  Eigen::Matrix<float, cells, cells> distance;  // of cell i of a and cell k of b
  distance.noalias() = -2 * a.poses.transpose() * b.poses;
  distance.colwise() += a.squares;
  distance.rowwise() += b.squares.transpose();
  distance = distance.cwiseMax(0).cwiseSqrt();
  distance.colwise() -= a.spread;
  distance.rowwise() -= b.spread.transpose();
  const Eigen::Matrix<float, cells, 1> of_second = distance.colwise().minCoeff().transpose().cwiseMax(0).cwiseAbs2();
  const Eigen::Matrix<float, cells, 1> of_first = distance.rowwise().minCoeff().cwiseMax(0).cwiseAbs2();
  const float least = std::max(least_mean(of_second, shortest_s_ / b.length_s * cells),
                               least_mean(of_first, shortest_s_ / a.length_s * cells));
  constexpr double rounding = 0.999;  // distances are of single precision
  return rounding * 100 * std::sqrt(static_cast<double>(least));
}

}  // namespace kinespace
