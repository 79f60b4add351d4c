#include "kinespace/synthesis/filling.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/motion/curves.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/synthesis/detail/filling_core.h"
#include "kinespace/synthesis/detail/filling_window.h"

namespace kinespace {
namespace {

using Eigen::Index;

template <typename T>
void require(const char* field, T value, T low, T high) {
  if (value >= low && value <= high) return;
  throw Error(ErrorKind::usage,
              {.found = fmt::format("{} = {}", field, value), .expected = fmt::format("{} to {}", low, high)});
}

PreparedSource source_of_library(LibraryView& library, const std::vector<ClipRow>& rows) {
  return {static_cast<int>(rows.size()), [&library, &rows](int i) {
            const ClipRow& row = rows[static_cast<std::size_t>(i)];
            return PreparedClip{library.skeleton(row.skeleton_id), library.curves(row), {}};
          }};
}

void require_same_tree(const FillModel& model, const Clip& clip) {
  if (model.library().skeleton().same_tree(clip.skeleton)) return;
  throw Error(ErrorKind::bad_input, {.file = clip.name,
                                     .found = "another skeleton than the library's",
                                     .expected = "the same joints, parents and channels",
                                     .remedy = "fill it with a library built from clips of its own skeleton"});
}

void require_gap_length(const FillModel& model, const Clip& clip, const FrameRange& gap) {
  const double length = gap.count() / clip.rate_hz;
  if (length <= model.options().max_gap_s + 1e-9) return;
  throw Error(ErrorKind::bad_input,
              {.file = clip.name,
               .found = fmt::format("a gap of {:.2f} s at {:.2f} s", length, gap.first_frame / clip.rate_hz),
               .expected = fmt::format("at most {} s", model.options().max_gap_s),
               .remedy = "what happens in so long a gap is not to be seen at its edges; raise max_gap_s to try"});
}

// Without a library: how far the spline is from straight lines says how much there is to be wrong about.
Eigen::MatrixXf short_gap_std(const Clip& straight, const Clip& filled, const FrameRange& gap) {
  const JointPositions a = joint_positions(slice(straight, gap.first_frame, gap.count()));
  const JointPositions b = joint_positions(slice(filled, gap.first_frame, gap.count()));
  Eigen::MatrixXf out(a.frames, a.joints);
  for (int f = 0; f < a.frames; ++f) {
    for (int j = 0; j < a.joints; ++j) {
      out(f, j) = static_cast<float>((a.at(f, j) - b.at(f, j)).norm() / std::sqrt(3.0));
    }
  }
  return out;
}

// Takes the gap's frames of what the curves carry.
void copy_gap(const Clip& from, const FrameRange& gap, Clip& to) {
  const CurveLayout layout = curve_layout(to.skeleton);
  const int root = layout.joints.front();
  to.require_translation_track(root);
  for (int f = gap.first_frame; f <= gap.last_frame; ++f) {
    for (const int j : layout.joints) to.set_rotation(j, f, from.rotation(j, f));
    to.translation_track(root)->values[static_cast<std::size_t>(f)] = from.translation(root, f);
  }
}

Clip turned(Clip clip, double angle_rad, const Eigen::Vector3d& shift_cm) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY()));
  auto& track = clip.require_translation_track(0);
  for (int f = 0; f < clip.frames; ++f) {
    clip.set_rotation(0, f, turn * clip.rotation(0, f));
    auto& at = track.values[static_cast<std::size_t>(f)];
    at = turn * at + shift_cm;
  }
  return clip;
}

// a, `gap` frames at rest, b.
Clip side_by_side(const Clip& a, const Clip& b, int gap) {
  Clip out = make_clip(a.name + "_" + b.name, a.skeleton, a.rate_hz, a.frames + gap + b.frames);
  const auto put = [&](const Clip& part, int at) {
    for (int j = 0; j < part.skeleton.joint_count(); ++j) {
      std::ranges::copy(part.rotation_track(j), out.rotation_track(j).begin() + 4 * static_cast<std::ptrdiff_t>(at));
    }
    for (const auto& track : part.translations) {
      std::ranges::copy(track.values, out.require_translation_track(track.joint).values.begin() + at);
    }
  };
  put(a, 0);
  put(b, a.frames + gap);
  return out;
}

}  // namespace

void FillOptions::validate() const {
  require("FillOptions.context_s", context_s, 0.05, 2.0);
  require("FillOptions.near_windows", near_windows, 4, 200);
  require("FillOptions.far_windows", far_windows, near_windows, 1000);
  require("FillOptions.max_gap_s", max_gap_s, 0.1, 20.0);
  require("FillOptions.calibration_gaps", calibration_gaps, 0, 2000);
}

void FillBetweenOptions::validate() const {
  if (!(gap_s > 0)) require("FillBetweenOptions.gap_s", gap_s, 0.01, 20.0);
}

FillModel::FillModel(FillOptions options, std::shared_ptr<const FillLibrary> library)
    : options_(options), library_(std::move(library)) {}

FillModel FillModel::build(const PreparedSource& clips, const FillOptions& options, const Progress& progress) {
  options.validate();
  FillModel out(options, std::make_shared<const FillLibrary>(clips, progress));
  out.calibration_ = std::make_shared<const FillCalibration>(calibrate(*out.library_, options, progress));
  return out;
}

FillModel FillModel::build(LibraryView& library, const Skeleton& skeleton, const FillOptions& options,
                           const Progress& progress) {
  std::vector<ClipRow> rows;
  for (ClipRow& row : library.library().clips()) {
    if (library.skeleton(row.skeleton_id).same_tree(skeleton)) rows.push_back(std::move(row));
  }
  if (rows.empty()) {
    throw Error(ErrorKind::bad_input,
                {.file = library.library().path().string(),
                 .found = library.library().clips().empty() ? "a library without clips" : "no clip of this skeleton",
                 .expected = "clips with the same joints, parents and channels",
                 .remedy = "add some with kinespace build --add"});
  }
  return build(source_of_library(library, rows), options, progress);
}

int FillModel::clips() const {
  return static_cast<int>(library_->tracks().size());
}

double FillModel::duration_s() const {
  return library_->frames() / filling_rate_hz;
}

double FillModel::interval(double p) const {
  require("p", p, 0.01, 0.99);
  const auto& q = calibration_->quantiles;
  if (q.empty()) return normal_interval(p);
  const double at = p * 100 - 1;
  const auto low = std::min(static_cast<std::size_t>(at), q.size() - 1);
  const std::size_t high = std::min(low + 1, q.size() - 1);
  return q[low] + (at - static_cast<double>(low)) * (q[high] - q[low]);
}

FillResult fill(const FillModel& model, const Clip& clip, std::span<const FrameRange> gaps) {
  const std::vector<FrameRange> ranges(gaps.begin(), gaps.end());
  require_same_tree(model, clip);
  require_fillable(clip, ranges);
  for (const FrameRange& gap : ranges) require_gap_length(model, clip, gap);

  FillResult out{.clip = clip, .gaps = {}};
  for (const FrameRange& gap : ranges) out.clip = interpolate_gap(std::move(out.clip), gap);
  const FillSetting setting(model, out.clip, ranges);
  ClipCurves curves = setting.curves();
  std::vector<GapFrames> filled;
  for (std::size_t i = 0; i < ranges.size(); ++i) filled.push_back(setting.fill_gap(i, curves));

  const Clip decoded = clip_from_curves(curves, clip.skeleton);
  const Clip straight = out.clip;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    copy_gap(decoded, ranges[i], out.clip);
    FilledGap gap{.frames = ranges[i], .windows = filled[i].windows, .std_cm = std::move(filled[i].std_cm)};
    if (gap.windows == 0) gap.std_cm = short_gap_std(straight, out.clip, ranges[i]);
    out.gaps.push_back(std::move(gap));
  }
  return out;
}

FillResult fill(const FillModel& model, const Clip& clip, FrameRange gap) {
  return fill(model, clip, std::span(&gap, 1));
}

FillResult fill_between(const FillModel& model, const Clip& a, const Clip& b, const FillBetweenOptions& options) {
  options.validate();
  require_same_tree(model, a);
  require_same_tree(model, b);
  if (std::abs(a.rate_hz - b.rate_hz) > 1e-6 * a.rate_hz) {
    throw Error(ErrorKind::bad_input, {.file = b.name,
                                       .found = fmt::format("{} frames a second", b.rate_hz),
                                       .expected = fmt::format("{}, as {} has", a.rate_hz, a.name)});
  }
  const int count = static_cast<int>(std::lround(options.gap_s * a.rate_hz)) - 1;
  const FrameRange gap{a.frames, a.frames + count - 1};
  if (count < 1) {
    throw Error(ErrorKind::usage, {.found = fmt::format("FillBetweenOptions.gap_s = {}", options.gap_s),
                                   .expected = fmt::format("room for a frame: at least {} s", 2 / a.rate_hz)});
  }
  Clip both = side_by_side(a, b, count);
  require_fillable(both, {gap});
  require_gap_length(model, both, gap);
  if (!options.keep_placement) {
    const FillSetting setting(model, interpolate_gap(both, gap), {gap});
    const GroundMove move = setting.placement_after(0);
    both = side_by_side(a, turned(b, move.angle_rad, move.shift_cm), count);
  }
  return fill(model, both, gap);
}

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
  std::vector<JointFrame> is;
  std::vector<JointFrame> should;
  const auto first = static_cast<std::size_t>(library.layout().joints.front());
  for (std::size_t i = 0; i < estimate.spread.rows.size(); ++i) {
    const Index r = estimate.spread.rows[i];
    feature_frames(library, estimate.mean.row(r), is);
    feature_frames(library, truth.row(shape.before + r).cast<double>(), should);
    for (std::size_t j = first; j < is.size(); ++j) {
      Miss miss;
      for (std::size_t s = 0; s < miss.variance.size(); ++s) {
        miss.variance[s] = estimate.spread.variance[s](static_cast<Index>(i), static_cast<Index>(j));
      }
      for (int axis = 0; axis < 3; ++axis) {
        miss.error = is[j].position(axis) - should[j].position(axis);
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
    parallel_for(std::size_t{0}, trials.size(),
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
