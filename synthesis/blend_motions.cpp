#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/synthesis/curve_sampler.h"
#include "kinespace/synthesis/detail/side_track_blend.h"
#include "kinespace/synthesis/detail/time_alignment.h"
#include "kinespace/synthesis/interpolation.h"

namespace kinespace {
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
