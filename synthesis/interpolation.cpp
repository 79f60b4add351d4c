#include "kinespace/synthesis/interpolation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <vector>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/synthesis/curve_sampler.h"
#include "kinespace/synthesis/detail/library_clips.h"
#include "kinespace/synthesis/detail/side_track_blend.h"
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

namespace {

// The motion, beyond the first `through`, that is nearest to the point with these weights; -1 when none is within
// `radius`.
Eigen::Index nearest_other(const Eigen::MatrixXd& vectors, int through, const Eigen::VectorXd& weights, double radius) {
  const Eigen::RowVectorXd point = weights.transpose() * vectors;
  Eigen::Index best = -1;
  double least = radius;
  for (Eigen::Index i = through; i < vectors.rows(); ++i) {
    const double distance = (vectors.row(i) - point).norm();
    if (distance < least) {
      least = distance;
      best = i;
    }
  }
  return best;
}

}  // namespace

BezierWeights::BezierWeights(Eigen::MatrixXd controls) : controls_(std::move(controls)) {}

BezierWeights BezierWeights::through_motions(const Eigen::MatrixXd& vectors, int through) {
  const Eigen::Index motions = vectors.rows();
  const auto unit = [&](int i) -> Eigen::VectorXd { return Eigen::VectorXd::Unit(motions, i); };
  // From each motion a third of the way along the curve's direction there; the way back is its mirror image.
  std::vector<Eigen::VectorXd> ahead(static_cast<std::size_t>(through));
  for (int i = 0; i < through; ++i) {
    const int before = std::max(i - 1, 0), after = std::min(i + 1, through - 1);
    const Eigen::VectorXd direction = (unit(after) - unit(before)) / std::max(after - before, 1);
    Eigen::VectorXd ideal = unit(i) + direction / 3;
    const double radius = (direction.transpose() * vectors).norm() / 3;
    // The last motion's own control point lies before it, so its mirror image is what has to be real.
    const bool last = i == through - 1;
    const Eigen::VectorXd wanted = last ? Eigen::VectorXd(2 * unit(i) - ideal) : ideal;
    const Eigen::Index real = nearest_other(vectors, through, wanted, radius);
    if (real >= 0) {
      const Eigen::VectorXd control = Eigen::VectorXd::Unit(motions, real);
      ideal = last ? Eigen::VectorXd(2 * unit(i) - control) : control;
    }
    ahead[static_cast<std::size_t>(i)] = ideal;
  }
  Eigen::MatrixXd controls(3 * (through - 1) + 1, motions);
  for (int i = 0; i + 1 < through; ++i) {
    controls.row(3 * i) = unit(i).transpose();
    controls.row(3 * i + 1) = ahead[static_cast<std::size_t>(i)].transpose();
    controls.row(3 * i + 2) = (2 * unit(i + 1) - ahead[static_cast<std::size_t>(i) + 1]).transpose();
  }
  controls.row(3 * (through - 1)) = unit(through - 1).transpose();
  return BezierWeights(std::move(controls));
}

Eigen::VectorXd BezierWeights::at(double t) const {
  t = std::clamp(t, 0.0, static_cast<double>(segments()));
  const int segment = std::min(static_cast<int>(t), std::max(segments() - 1, 0));
  if (segments() == 0) return controls_.row(0).transpose();
  const double x = t - segment, y = 1 - x;
  const auto p = controls_.middleRows(3L * segment, 4);
  return (y * y * y * p.row(0) + 3 * x * y * y * p.row(1) + 3 * x * x * y * p.row(2) + x * x * x * p.row(3))
      .transpose();
}

namespace {

constexpr int steps_per_frame = 8;

// When every motion is where, step by step: straight between the steps, so that a blend's time and the motions' own
// times agree exactly.
struct BlendClock {
  std::vector<double> time;  // the blend's, seconds
  SampleMatrix own;          // [step][motion]

  [[nodiscard]] double duration_s() const { return time.back(); }
  // The share of the blend's way that is behind at a time, and every motion's own time.
  double at(double time_s, Eigen::RowVectorXd& own_s) const {
    const auto after = std::ranges::upper_bound(time, time_s) - time.begin();
    const auto i = std::clamp<std::ptrdiff_t>(after - 1, 0, std::ssize(time) - 2);
    const double width = time[static_cast<std::size_t>(i) + 1] - time[static_cast<std::size_t>(i)];
    const double b = std::clamp((time_s - time[static_cast<std::size_t>(i)]) / width, 0.0, 1.0);
    own_s = (1 - b) * own.row(i) + b * own.row(i + 1);
    return (static_cast<double>(i) + b) / static_cast<double>(own.rows() - 1);
  }
};

BlendClock make_clock(std::span<const ClipCurves> motions, const Skeleton& skeleton, const WeightCurve& weights) {
  std::vector<TimeMap> maps;
  double longest = 0;
  for (const ClipCurves& motion : motions) {
    const double duration = (motion.frames() - 1) / motion.rate_hz;
    longest = std::max(longest, duration * motion.rate_hz);
    maps.push_back(&motion == motions.data() ? TimeMap(duration, duration)
                                             : align_times(motions.front(), motion, skeleton));
  }
  const int steps = std::max(16, static_cast<int>(std::ceil(longest)) * steps_per_frame);
  BlendClock clock{.time = std::vector<double>(static_cast<std::size_t>(steps) + 1),
                   .own = SampleMatrix(steps + 1, static_cast<Eigen::Index>(motions.size()))};
  for (int i = 0; i <= steps; ++i) {
    for (std::size_t m = 0; m < maps.size(); ++m) {
      clock.own(i, static_cast<Eigen::Index>(m)) = maps[m](maps[0].to_s() * i / steps);
    }
  }
  constexpr double least_share = 0.2;  // of the slowest motion's time that passes whatever negative weights say
  for (int i = 0; i < steps; ++i) {
    const Eigen::RowVectorXd passing = clock.own.row(i + 1) - clock.own.row(i);
    const double step = passing * weights((i + 0.5) / steps);
    clock.time[static_cast<std::size_t>(i) + 1] =
        clock.time[static_cast<std::size_t>(i)] + std::max(step, least_share * passing.minCoeff());
  }
  return clock;
}

// Of each motion and joint: 1 or -1, so that all lie on the first motion's side at corresponding times.
Eigen::MatrixXd common_sides(std::span<const CurveSampler> samplers, const BlendClock& clock) {
  constexpr int looks = 33;
  const Eigen::Index joints = (samplers[0].curves() - travel_curves) / 4;
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(samplers.size()), joints);
  Eigen::RowVectorXd own, first(samplers[0].curves()), other(samplers[0].curves());
  for (int i = 0; i < looks; ++i) {
    clock.at(clock.duration_s() * i / (looks - 1), own);
    samplers[0].at(own(0), first);
    for (std::size_t m = 0; m < samplers.size(); ++m) {
      const auto row = static_cast<Eigen::Index>(m);
      samplers[m].at(own(row), other);
      for (Eigen::Index j = 0; j < joints; ++j) {
        out(row, j) += first.segment<4>(travel_curves + 4 * j).dot(other.segment<4>(travel_curves + 4 * j));
      }
    }
  }
  return out.unaryExpr([](double sum) { return sum < 0 ? -1.0 : 1.0; });
}

// Where the blend starts: between the motions' starts, so that weights of 1 and 0 give a motion back where it was.
Placement blended_placement(std::span<const ClipCurves> motions, const Eigen::VectorXd& weights) {
  Placement out{.start_cm = Eigen::Vector3d::Zero(), .heading_rad = motions[0].placement.heading_rad};
  for (std::size_t m = 0; m < motions.size(); ++m) {
    const double weight = weights(static_cast<Eigen::Index>(m));
    const double turn = motions[m].placement.heading_rad - motions[0].placement.heading_rad;
    out.start_cm += weight * motions[m].placement.start_cm;
    out.heading_rad += weight * std::remainder(turn, 2 * std::numbers::pi);
  }
  return out;
}

void require_motion(const ClipCurves& motion) {
  if (motion.frames() > 1) return;
  throw Error(ErrorKind::bad_input,
              {.found = motion.name + " of a single frame", .expected = "a motion of two frames or more"});
}

std::string joined_names(std::span<const ClipCurves> motions) {
  std::string out;
  for (const ClipCurves& motion : motions) out += (out.empty() ? "" : "~") + motion.name;
  return out;
}

}  // namespace

BlendedMotion blend_motions(std::span<const ClipCurves> motions, const Skeleton& skeleton, const WeightCurve& weights) {
  std::vector<CurveSampler> samplers;
  for (const ClipCurves& motion : motions) {
    require_motion(motion);
    samplers.emplace_back(motion);
  }
  const BlendClock clock = make_clock(motions, skeleton, weights);
  const Eigen::MatrixXd sides = common_sides(samplers, clock);

  const double rate = motions[0].rate_hz;
  constexpr double rounding = 1e-6;  // of a frame
  const int frames = static_cast<int>(std::floor(clock.duration_s() * rate + rounding)) + 1;
  ClipCurves out{.name = joined_names(motions),
                 .rate_hz = rate,
                 .placement = motions[0].placement,
                 .values = SampleMatrix::Zero(frames, samplers[0].curves())};
  std::vector<std::vector<FramePart>> parts(static_cast<std::size_t>(frames));
  SampleMatrix travel(static_cast<Eigen::Index>(motions.size()), travel_curves), travel_before = travel;
  Eigen::RowVectorXd own, pose(samplers[0].curves());
  double share_before = 0;
  for (int f = 0; f < frames; ++f) {
    const double share = clock.at(f / rate, own);
    const Eigen::VectorXd weight = weights(share);
    auto row = out.values.row(f);
    for (std::size_t m = 0; m < motions.size(); ++m) {
      const auto i = static_cast<Eigen::Index>(m);
      const double frame = own(i) * motions[m].rate_hz, nearest = std::round(frame);
      if (std::abs(frame - nearest) < rounding) own(i) = nearest / motions[m].rate_hz;
      samplers[m].at(own(i), pose);
      travel.row(i) = pose.head<travel_curves>();
      for (Eigen::Index j = 0; j < sides.cols(); ++j) {
        row.segment<4>(travel_curves + 4 * j) += weight(i) * sides(i, j) * pose.segment<4>(travel_curves + 4 * j);
      }
      parts[static_cast<std::size_t>(f)].push_back({m, own(i), weight(i)});
    }
    for (Eigen::Index j = 0; j < sides.cols(); ++j) row.segment<4>(travel_curves + 4 * j).normalize();
    // Velocities are blended, not places: the weights of the step between two frames say where it leads.
    if (f > 0) {
      const Eigen::VectorXd between = weights((share + share_before) / 2);
      row.head<travel_curves>() =
          out.values.row(f - 1).head<travel_curves>() + between.transpose() * (travel - travel_before);
    }
    travel_before = travel;
    share_before = share;
  }
  out.placement = blended_placement(motions, weights(0));
  out.side_tracks = blend_side_tracks(motions, parts, skeleton);

  BlendedMotion blended{.clip = clip_from_curves(out, skeleton)};
  std::vector<JointRates> rates;
  std::vector<const JointRates*> sources;
  for (const ClipCurves& motion : motions) rates.push_back(joint_rates(clip_from_curves(motion, skeleton)));
  for (const JointRates& source : rates) sources.push_back(&source);
  blended.ratios = seam_ratios(joint_rates(blended.clip), 0, clock.duration_s(), usual_rates(sources));
  return blended;
}

}  // namespace kinespace
