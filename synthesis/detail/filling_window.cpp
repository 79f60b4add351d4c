#include "kinespace/synthesis/detail/filling_window.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/uniform_spline.h"

namespace kinespace {
namespace {

using Eigen::Index;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// The heading of a row of curves, and its turn.
double heading_of_row(const Eigen::RowVectorXd& row) {
  return heading_of(Quaterniond(row(3), row(4), row(5), row(6)));
}

Quaterniond turn_of(double angle_rad) {
  return Quaterniond(Eigen::AngleAxisd(angle_rad, Vector3d::UnitY()));
}

// A row of features, as seen from the reference row of curves, as a row of curves (y above the floor).
Eigen::RowVectorXd unplaced(Eigen::RowVectorXd row, const Eigen::RowVectorXd& weights,
                            const Eigen::RowVectorXd& reference) {
  row.array() /= weights.array();
  const Quaterniond turn = turn_of(heading_of_row(reference));
  const Vector3d ground(reference(0), 0, reference(2));
  row.head<3>() = (turn * Vector3d(row.head<3>()) + ground).transpose();
  const Quaterniond root = (turn * Quaterniond(row(3), row(4), row(5), row(6))).normalized();
  row.segment<4>(3) << root.w(), root.x(), root.y(), root.z();
  return row;
}

// Standard deviations at every knot from the edge before the gap to the edge after it, both of which are known: between
// the given rows straight lines.
Eigen::MatrixXd at_all_knots(const Eigen::MatrixXd& std_cm, const std::vector<int>& rows, int gap) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(gap + 2, std_cm.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto n = static_cast<Index>(i);
    const int from = i > 0 ? rows[i - 1] : -1;
    for (int r = from + 1; r <= rows[i]; ++r) {
      const double t = static_cast<double>(r - from) / (rows[i] - from);
      out.row(r + 1) = t * std_cm.row(n);
      if (i > 0) out.row(r + 1) += (1 - t) * std_cm.row(n - 1);
    }
  }
  return out;
}

}  // namespace

double normal_interval(double p) {
  double low = 0;
  double high = 10;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (std::erf(middle / std::sqrt(2.0)) < p ? low : high) = middle;
  }
  return (low + high) / 2;
}

FillSetting::FillSetting(const FillModel& model, const Clip& clip, std::vector<FrameRange> gaps)
    : model_(model), name_(clip.name), gaps_(std::move(gaps)), curves_(clip_curves(clip)), values_(curves_.values) {
  values_.col(1).array() += curves_.placement.start_cm.y() / 100;
  if (model.options().own_frames) own_ = seen_tracks();
}

std::vector<FillTrack> FillSetting::seen_tracks() const {
  std::vector<FillTrack> out;
  int first = 0;
  for (std::size_t i = 0; i <= gaps_.size(); ++i) {
    const int end = i < gaps_.size() ? gaps_[i].first_frame : curves_.frames();
    ClipCurves part{.name = name_, .rate_hz = curves_.rate_hz, .placement = curves_.placement};
    part.values = curves_.values.middleRows(first, end - first);
    out.push_back(model_.library().track_of(resampled_curves(part, filling_rate_hz)));
    if (i < gaps_.size()) first = gaps_[i].last_frame + 1;
  }
  return out;
}

FillSetting::Knots FillSetting::knots_of(std::size_t gap) const {
  const FrameRange range = gaps_[gap];
  const int before_from = gap > 0 ? gaps_[gap - 1].last_frame + 1 : 0;
  const int after_to = gap + 1 < gaps_.size() ? gaps_[gap + 1].first_frame - 1 : curves_.frames() - 1;
  const double rate = curves_.rate_hz;
  const double length = (range.count() + 1) / rate;
  Knots out;
  out.shape.gap = std::max(0, static_cast<int>(std::lround(length * filling_rate_hz)) - 1);
  out.step_s = length / (out.shape.gap + 1);
  const auto rows = [&](int frames) {
    const int most = static_cast<int>(std::lround(model_.options().context_s * filling_rate_hz)) + 1;
    return std::min(most, 1 + static_cast<int>(std::floor(frames / rate / out.step_s + 1e-9)));
  };
  out.shape.before = rows(range.first_frame - 1 - before_from);
  out.shape.after = rows(after_to - range.last_frame - 1);

  const UniformSpline before(values_.middleRows(before_from, range.first_frame - before_from));
  const UniformSpline after(values_.middleRows(range.last_frame + 1, after_to - range.last_frame));
  out.curves.resize(out.shape.frames(), values_.cols());
  const double step = out.step_s * rate;  // frames
  for (int r = 0; r < out.shape.frames(); ++r) {
    const int from_gap = r - out.shape.before;
    if (from_gap < 0) {
      before.value(static_cast<double>(before.samples() - 1) + (from_gap + 1) * step, out.curves.row(r));
    } else {
      after.value(std::max(0, from_gap - out.shape.gap) * step, out.curves.row(r));
    }
  }
  return out;
}

void FillSetting::fail_too_long(const Knots& knots, std::size_t gap) const {
  const double window = knots.shape.frames() * knots.step_s;
  throw Error(
      ErrorKind::bad_input,
      {.file = name_,
       .found = fmt::format("a gap of {:.2f} s at {:.2f} s", gaps_[gap].count() / curves_.rate_hz,
                            gaps_[gap].first_frame / curves_.rate_hz),
       .expected = fmt::format("a library with clips of at least {:.2f} s, the gap and what is seen beside it", window),
       .remedy = "add longer clips to the library"});
}

GapFrames FillSetting::fill_gap(std::size_t gap, ClipCurves& curves) const {
  const FillLibrary& library = model_.library();
  const FrameRange range = gaps_[gap];
  const Knots knots = knots_of(gap);
  const FillTrack query = library.track_of(knots.curves);
  FeatureMatrix features(knots.shape.frames(), library.curves());
  library.window(query, 0, knots.shape, features);
  SampleMatrix rows = features.cast<double>();

  GapFrames out{.windows = 0, .std_cm = Eigen::MatrixXf::Zero(range.count(), library.skeleton().joint_count())};
  Eigen::MatrixXd std_cm = Eigen::MatrixXd::Zero(knots.shape.gap + 2, library.skeleton().joint_count());
  if (knots.shape.gap > 0) {
    GapEstimate estimate = estimate_gap(library, model_.options(), query, knots.shape, {.extra = own_});
    if (estimate.windows < 2) fail_too_long(knots, gap);
    rows.middleRows(knots.shape.before, knots.shape.gap) = estimate.mean;
    out.windows = estimate.windows;
    std_cm = at_all_knots(model_.calibration().std_cm(estimate.spread, knots.step_s * (knots.shape.gap + 1)),
                          estimate.spread.rows, knots.shape.gap);
  }
  const UniformSpline spline(std::move(rows));
  Eigen::RowVectorXd row(library.curves());
  const Eigen::RowVectorXd reference = values_.row(range.first_frame - 1);
  for (int f = range.first_frame; f <= range.last_frame; ++f) {
    const double knot = (f - range.first_frame + 1) / curves_.rate_hz / knots.step_s;  // from the edge before the gap
    spline.value(knots.shape.reference() + knot, row);
    Eigen::RowVectorXd at = unplaced(row, library.weights(), reference);
    at(1) -= curves_.placement.start_cm.y() / 100;
    curves.values.row(f) = at;
    const auto low = std::min<Index>(static_cast<Index>(knot), std_cm.rows() - 2);
    const double t = knot - static_cast<double>(low);
    out.std_cm.row(f - range.first_frame) = ((1 - t) * std_cm.row(low) + t * std_cm.row(low + 1)).cast<float>();
  }
  return out;
}

GroundMove FillSetting::placement_after(std::size_t gap) const {
  const FillLibrary& library = model_.library();
  const Knots knots = knots_of(gap);
  const FillTrack query = library.track_of(knots.curves);
  const std::vector<FillWindow> windows =
      library.nearest(query, knots.shape, {.count = model_.options().near_windows, .free_placement = true});
  if (windows.empty()) fail_too_long(knots, gap);
  Vector3d travel = Vector3d::Zero();  // metres, as seen from the frame before the gap; windows as near weigh as much
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  double sum = 0;
  const double width = windows[windows.size() / 4].distance + 1e-12;
  for (const FillWindow& w : windows) {
    const FillTrack& track = library.tracks()[static_cast<std::size_t>(w.track)];
    const auto moved = placed_root(track.root.row(w.start + knots.shape.before + knots.shape.gap).data(),
                                   track.root.row(w.start + knots.shape.reference()).data())
                           .cast<double>()
                           .eval();
    const double weight = std::exp(-0.5 * (w.distance - windows.front().distance) / width);
    const double angle = heading_of(Quaterniond(moved(3), moved(4), moved(5), moved(6)));
    travel += weight * Vector3d(moved(0), 0, moved(2));
    heading += weight * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    sum += weight;
  }
  // From there to the world, and what is at the edge now to there.
  const Eigen::RowVectorXd last = values_.row(gaps_[gap].first_frame - 1);
  const Eigen::RowVectorXd next = values_.row(gaps_[gap].last_frame + 1);
  const double before = curves_.placement.heading_rad;
  const auto world = [&](const Eigen::RowVectorXd& row) -> Vector3d {
    return curves_.placement.start_cm + turn_of(before) * Vector3d(100 * row(0), 0, 100 * row(2));
  };
  const double facing = before + heading_of_row(last);
  const Vector3d target = world(last) + turn_of(facing) * Vector3d(100 * travel / sum);
  GroundMove out{.angle_rad = facing + std::atan2(heading(1), heading(0)) - before - heading_of_row(next)};
  out.shift_cm = target - turn_of(out.angle_rad) * world(next);
  out.shift_cm.y() = 0;
  return out;
}

}  // namespace kinespace
