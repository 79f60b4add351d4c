#include <algorithm>
#include <cmath>
#include <optional>

#include <tbb/parallel_for.h>

#include "kinespace/synthesis/detail/filling_core.h"

namespace kinespace {
namespace {

using Eigen::Index;

constexpr std::array<double, 5> lengths_s = {0.25, 0.5, 1, 2, 4};
constexpr double least_variance = 1e-8;  // cm^2

// What one joint's error on one axis was, in one row, and the sources there.
struct Miss {
  double error = 0;
  std::array<double, GapSpread::sources> variance = {};
};

double variance_of(const std::array<double, GapSpread::sources>& shares,
                   const std::array<double, GapSpread::sources>& variance) {
  double out = least_variance;
  for (std::size_t i = 0; i < shares.size(); ++i) out += shares[i] * variance[i];
  return out;
}

FillTrack part_of(const FillTrack& track, int first, int count) {
  return {track.root.middleRows(first, count), track.body.middleRows(first, count),
          track.index.middleRows(first, count)};
}

struct Trial {
  int track = 0;
  int start = 0;
};

// `count` windows spread evenly over all that the library has.
std::vector<Trial> trials_of(const FillLibrary& library, const WindowShape& shape, int count) {
  std::int64_t all = 0;
  for (const FillTrack& t : library.tracks()) all += std::max(0, t.frames() - shape.frames() + 1);
  std::vector<Trial> out;
  std::int64_t passed = 0;
  for (std::size_t i = 0; i < library.tracks().size(); ++i) {
    const std::int64_t here = std::max(0, library.tracks()[i].frames() - shape.frames() + 1);
    while (static_cast<int>(out.size()) < count && all > 0) {
      const std::int64_t next = (2 * static_cast<std::int64_t>(out.size()) + 1) * all / (2 * count);
      if (next >= passed + here) break;
      out.push_back({static_cast<int>(i), static_cast<int>(next - passed)});
    }
    passed += here;
  }
  return out;
}

// Fills a gap cut into the library, without its clip but for what lies outside the gap.
std::vector<Miss> misses_of(const FillLibrary& library, const FillOptions& options, const WindowShape& shape,
                            const Trial& trial) {
  const FillTrack& track = library.tracks()[static_cast<std::size_t>(trial.track)];
  const FillTrack query = part_of(track, trial.start, shape.frames());
  std::vector<FillTrack> own;
  if (options.own_frames) {
    const int gap = trial.start + shape.before;
    own.push_back(part_of(track, 0, gap));
    own.push_back(part_of(track, gap + shape.gap, track.frames() - gap - shape.gap));
  }
  const GapEstimate estimate = estimate_gap(library, options, query, shape, {.without = trial.track, .extra = own});
  if (estimate.mean.rows() == 0) return {};
  FeatureMatrix truth(shape.frames(), library.curves());
  library.window(query, 0, shape, truth);
  std::vector<Miss> out;
  std::vector<Eigen::Vector3d> is;
  std::vector<Eigen::Vector3d> should;
  const auto first = static_cast<std::size_t>(library.layout().joints.front());
  for (std::size_t i = 0; i < estimate.spread.rows.size(); ++i) {
    const Index r = estimate.spread.rows[i];
    feature_positions(library, estimate.mean.row(r), is);
    feature_positions(library, truth.row(shape.before + r).cast<double>(), should);
    for (std::size_t j = first; j < is.size(); ++j) {
      Miss miss;
      for (std::size_t s = 0; s < miss.variance.size(); ++s) {
        miss.variance[s] = estimate.spread.variance[s](static_cast<Index>(i), static_cast<Index>(j));
      }
      for (int axis = 0; axis < 3; ++axis) {
        miss.error = is[j](axis) - should[j](axis);
        out.push_back(miss);
      }
    }
  }
  return out;
}

// Share p of the sizes does not exceed the result.
double quantile(std::vector<double>& sizes, double p) {
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(p * static_cast<double>(sizes.size() - 1));
  std::ranges::nth_element(sizes, at);
  return *at;
}

std::vector<double> ratios(const std::vector<Miss>& misses, const std::array<double, GapSpread::sources>& shares) {
  std::vector<double> out;
  out.reserve(misses.size());
  for (const Miss& m : misses) out.push_back(std::abs(m.error) / std::sqrt(variance_of(shares, m.variance)));
  return out;
}

// Shares of the largest likelihood for normal errors (multiplicative updates as for non-negative factors under the
// Itakura-Saito divergence: Fevotte, Bertin, Durrieu 2009), errors counted up to four standard deviations so that a few
// gaps with a surprise in them do not decide; then scaled so that 80 % of the errors lie where they should.
std::array<double, GapSpread::sources> fit_shares(const std::vector<Miss>& misses) {
  std::array<double, GapSpread::sources> shares = {1, 1, 1};
  for (int round = 0; round < 40; ++round) {
    std::array<double, GapSpread::sources> up = {};
    std::array<double, GapSpread::sources> down = {};
    for (const Miss& m : misses) {
      const double v = variance_of(shares, m.variance);
      const double e = std::min(m.error * m.error, 16 * v);
      for (std::size_t s = 0; s < shares.size(); ++s) {
        up[s] += e * m.variance[s] / (v * v);
        down[s] += m.variance[s] / v;
      }
    }
    for (std::size_t s = 0; s < shares.size(); ++s) {
      if (down[s] > 0) shares[s] = std::max(shares[s] * std::sqrt(up[s] / down[s]), 1e-6);
    }
  }
  constexpr double normal_80 = 1.2815515655446004;
  std::vector<double> sizes = ratios(misses, shares);
  const double scale = quantile(sizes, 0.8) / normal_80;
  for (double& s : shares) s *= scale * scale;
  return shares;
}

}  // namespace

Eigen::MatrixXd FillCalibration::std_cm(const GapSpread& spread, double gap_s) const {
  std::size_t i = 0;
  while (i + 2 < lengths.size() && lengths[i + 1].gap_s < gap_s) ++i;
  const Length& low = lengths[i];
  const Length& high = lengths[std::min(i + 1, lengths.size() - 1)];
  double t = 0;
  if (high.gap_s > low.gap_s) t = std::clamp(std::log(gap_s / low.gap_s) / std::log(high.gap_s / low.gap_s), 0.0, 1.0);
  Eigen::MatrixXd variance =
      Eigen::MatrixXd::Constant(spread.variance[0].rows(), spread.variance[0].cols(), least_variance);
  for (std::size_t s = 0; s < spread.variance.size(); ++s) {
    variance += std::exp((1 - t) * std::log(low.shares[s]) + t * std::log(high.shares[s])) * spread.variance[s];
  }
  return variance.cwiseSqrt();
}

FillCalibration calibrate(const FillLibrary& library, const FillOptions& options, const Progress& progress) {
  FillCalibration out;
  std::vector<double> all;
  const int side = static_cast<int>(std::lround(options.context_s * filling_rate_hz)) + 1;
  for (std::size_t l = 0; l < lengths_s.size() && options.calibration_gaps > 0; ++l) {
    if (lengths_s[l] > options.max_gap_s && !out.lengths.empty()) break;
    const int gap = static_cast<int>(std::lround(lengths_s[l] * filling_rate_hz));
    const WindowShape shape{.before = side, .gap = gap, .after = side};
    const std::vector<Trial> trials = trials_of(library, shape, options.calibration_gaps);
    std::vector<std::vector<Miss>> parts(trials.size());
    tbb::parallel_for(std::size_t{0}, trials.size(),
                      [&](std::size_t i) { parts[i] = misses_of(library, options, shape, trials[i]); });
    progress.check_stop();
    progress.at("calibrate", static_cast<double>(l + 1) / lengths_s.size());
    std::vector<Miss> misses;
    for (const auto& part : parts) misses.insert(misses.end(), part.begin(), part.end());
    if (misses.empty()) break;
    out.lengths.push_back({.gap_s = lengths_s[l], .shares = fit_shares(misses)});
    const std::vector<double> r = ratios(misses, out.lengths.back().shares);
    all.insert(all.end(), r.begin(), r.end());
  }
  if (out.lengths.empty()) {
    out.lengths.push_back({.gap_s = 1});
    return out;
  }
  std::ranges::sort(all);
  for (int p = 1; p < 100; ++p) {
    out.quantiles.push_back(all[static_cast<std::size_t>(p / 100.0 * static_cast<double>(all.size() - 1))]);
  }
  return out;
}

}  // namespace kinespace
