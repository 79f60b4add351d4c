#include "kinespace/synthesis/transition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/synthesis/curve_sampler.h"
#include "kinespace/synthesis/detail/side_track_blend.h"

namespace kinespace {
namespace {

constexpr int clock_points = 257;

// 0 to 1 with first and second derivative 0 at both ends.
double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

// The second motion's time within an overlap, by the output's clock: its speed goes from 1 / u to 1, times what slows
// the whole down in the middle.
class OverlapClock {
 public:
  // The overlap lasts exactly `duration_s`.
  OverlapClock(const Connection& connection, double duration_s)
      : connection_(connection), duration_s_(duration_s), second_s_(clock_points) {
    const double length = connection.entered_s - connection.enter_s;
    const double slow = 2 * (length / duration_s - plain_mean(connection));  // the bump's mean is 1/2
    const double step = duration_s / (clock_points - 1);
    const auto speed = [&](double x) {
      const double bump = std::sin(std::numbers::pi * x);
      return plain_speed(connection, x) + slow * bump * bump;
    };
    double time = connection.enter_s;
    for (int i = 0; i < clock_points; ++i) {
      second_s_[static_cast<std::size_t>(i)] = time;
      const double x = static_cast<double>(i) / (clock_points - 1);
      const double half = 0.5 / (clock_points - 1);
      time += step * (speed(x) + 4 * speed(x + half) + speed(x + 2 * half)) / 6;
    }
  }

  // How long the overlap lasts when nothing slows it down.
  [[nodiscard]] static double plain_duration(const Connection& connection) {
    return (connection.entered_s - connection.enter_s) / plain_mean(connection);
  }

  [[nodiscard]] double second_s(double overlap_s) const {
    const double at = std::clamp(overlap_s / duration_s_, 0.0, 1.0) * (clock_points - 1);
    const auto i = std::min(static_cast<std::size_t>(at), static_cast<std::size_t>(clock_points - 2));
    const double b = at - static_cast<double>(i);
    return (1 - b) * second_s_[i] + b * second_s_[i + 1];
  }
  [[nodiscard]] double first_s(double overlap_s) const {
    return connection_.leave_s + connection_.speed() * (second_s(overlap_s) - connection_.enter_s);
  }

 private:
  static double plain_speed(const Connection& connection, double x) {
    return std::pow(connection.speed(), smooth_step(x) - 1);
  }
  static double plain_mean(const Connection& connection) {
    double sum = 0;
    for (int i = 0; i < clock_points - 1; ++i) sum += plain_speed(connection, (i + 0.5) / (clock_points - 1));
    return sum / (clock_points - 1);
  }

  Connection connection_;
  double duration_s_;
  std::vector<double> second_s_;
};

ClipCurves poses_at(const CurveSampler& sampler, std::span<const double> times) {
  ClipCurves out{.rate_hz = 1, .values = SampleMatrix(static_cast<Eigen::Index>(times.size()), sampler.curves())};
  for (std::size_t i = 0; i < times.size(); ++i) sampler.at(times[i], out.values.row(static_cast<Eigen::Index>(i)));
  return out;
}

// `pose` becomes the blend of itself (weight 1 - w) and of `other`.
void blend_pose(Eigen::RowVectorXd& pose, const Eigen::RowVectorXd& other, const Eigen::RowVectorXd& signs, double w) {
  pose.head<travel_curves>() = (1 - w) * pose.head<travel_curves>() + w * other.head<travel_curves>();
  for (Eigen::Index c = travel_curves; c + 3 < pose.size(); c += 4) {
    const Eigen::Vector4d a = pose.segment<4>(c).transpose();
    const Eigen::Vector4d b = other.segment<4>(c).transpose() * signs((c - travel_curves) / 4);
    const double angle = std::acos(std::clamp(a.dot(b), -1.0, 1.0));
    const double sine = std::sin(angle);
    Eigen::Vector4d q = sine < 1e-6 ? Eigen::Vector4d((1 - w) * a + w * b)
                                    : Eigen::Vector4d((std::sin((1 - w) * angle) * a + std::sin(w * angle) * b) / sine);
    pose.segment<4>(c) = q.normalized().transpose();
  }
}

// Two motions, joined: poses by the time since the overlap began.
class JoinedPair {
 public:
  JoinedPair(const CurveSampler& first, const CurveSampler& second, const Join& join)
      : first_(first), second_(second), join_(join), clock_(join.connection, join.duration_s), other_(second.curves()) {
    constexpr int looks = 9;
    signs_.setZero((first.curves() - travel_curves) / 4);
    Eigen::RowVectorXd pose(first.curves());
    for (int i = 0; i < looks; ++i) {
      const double overlap_s = join.duration_s * i / (looks - 1);
      first_.at(clock_.first_s(overlap_s), pose);
      second_at(clock_.second_s(overlap_s), other_);
      for (Eigen::Index k = 0; k < signs_.size(); ++k) {
        signs_(k) += pose.segment<4>(travel_curves + 4 * k).dot(other_.segment<4>(travel_curves + 4 * k));
      }
    }
    for (double& sign : signs_) sign = sign < 0 ? -1 : 1;
  }

  // The second motion's share and both motions' times.
  struct Shares {
    double second = 0;
    double first_s = 0, second_s = 0;
  };
  Shares at(double overlap_s, Eigen::RowVectorXd& pose) {
    if (overlap_s >= join_.duration_s) {
      const double second_s = join_.connection.entered_s + overlap_s - join_.duration_s;
      second_at(second_s, pose);
      return {1, join_.connection.left_s, second_s};
    }
    if (overlap_s <= 0) {
      const double first_s = join_.connection.leave_s + overlap_s;
      first_.at(first_s, pose);
      return {0, first_s, join_.connection.enter_s};
    }
    const Shares shares{smooth_step(overlap_s / join_.duration_s), clock_.first_s(overlap_s),
                        clock_.second_s(overlap_s)};
    first_.at(shares.first_s, pose);
    second_at(shares.second_s, other_);
    blend_pose(pose, other_, signs_, shares.second);
    return shares;
  }

 private:
  void second_at(double time_s, Eigen::RowVectorXd& pose) const {
    second_.at(time_s, pose);
    join_.placement.apply(pose);
  }

  const CurveSampler& first_;
  const CurveSampler& second_;
  Join join_;
  OverlapClock clock_;
  Eigen::RowVectorXd other_, signs_;
};

// Heights are of the world: clips keep theirs where they are joined.
ClipCurves at_world_height(ClipCurves curves) {
  curves.values.col(1).array() += curves.placement.start_cm.y() / 100;
  curves.placement.start_cm.y() = 0;
  return curves;
}

// What is asked of the sources again and again.
struct Source {
  explicit Source(const ClipCurves& curves, const Skeleton& skeleton)
      : sampler(at_world_height(curves)), rates(joint_rates(clip_from_curves(curves, skeleton))) {}
  CurveSampler sampler;
  JointRates rates;
};

// How far the lowest joint of frames [begin, end) is below the lowest of the others: poses between two others may put a
// foot through the ground.
double sink_of(const JointPositions& positions, int begin, int end) {
  double inside = std::numeric_limits<double>::infinity();
  double around = inside;
  for (int f = 0; f < positions.frames; ++f) {
    double& lowest = f >= begin && f < end ? inside : around;
    for (int j = 0; j < positions.joints; ++j) lowest = std::min(lowest, positions.at(f, j).y());
  }
  return std::isfinite(inside) ? std::max(0.0, around - inside) : 0;
}

// The seam of a join, from 0.25 s before the overlap to 0.25 s after it, at the first motion's rate.
void measure_seam(const Source& first, const Source& second, const Skeleton& skeleton, Join& join) {
  constexpr double around_s = 0.25;
  const double step = 1 / first.sampler.rate_hz();
  const int before = static_cast<int>(std::ceil(around_s / step)) + 1;
  const int after = static_cast<int>(std::ceil((join.duration_s + around_s) / step)) + 1;
  JoinedPair pair(first.sampler, second.sampler, join);
  ClipCurves curves{.rate_hz = first.sampler.rate_hz(),
                    .values = SampleMatrix(before + after + 1, first.sampler.curves())};
  Eigen::RowVectorXd pose(first.sampler.curves());
  // The output's frames are those of the first motion, so the overlap begins between two of them.
  const double phase = std::ceil(join.connection.leave_s / step) * step - join.connection.leave_s;
  for (int i = -before; i <= after; ++i) {
    pair.at(phase + i * step, pose);
    curves.values.row(i + before) = pose;
  }
  const std::array<const JointRates*, 2> sources{&first.rates, &second.rates};
  const double begin_s = before * step - phase;
  const Clip seam = clip_from_curves(curves, skeleton);
  join.ratios = seam_ratios(joint_rates(seam), begin_s, begin_s + join.duration_s, usual_rates(sources));
  join.sink_cm = sink_of(joint_positions(seam), static_cast<int>(std::ceil(begin_s / step)),
                         static_cast<int>(std::floor((begin_s + join.duration_s) / step)) + 1);
}

Join join_by(const Connection& connection, const Source& first, const Source& second, double stretch,
             const Skeleton& skeleton) {
  // The second motion's frames shall be frames of the output where both have one rate: the overlap's length gives way.
  const double step = 1 / first.sampler.rate_hz();
  const double wanted = stretch * OverlapClock::plain_duration(connection);
  const double steps = std::round((connection.leave_s + wanted - connection.entered_s) / step);
  const double duration = steps * step + connection.entered_s - connection.leave_s;
  Join join{.connection = connection, .duration_s = duration > step ? duration : duration + step, .stretch = stretch};

  constexpr int looks = 12;
  const OverlapClock clock(connection, join.duration_s);
  std::array<double, looks> first_s{}, second_s{};
  for (int i = 0; i < looks; ++i) {
    const double overlap_s = join.duration_s * (i + 0.5) / looks;
    first_s[static_cast<std::size_t>(i)] = clock.first_s(overlap_s);
    second_s[static_cast<std::size_t>(i)] = clock.second_s(overlap_s);
  }
  join.placement = ground_alignment(first.sampler, first_s, second.sampler, second_s, skeleton);
  measure_seam(first, second, skeleton, join);
  return join;
}

std::optional<Join> smoothest_join(const ConnectionSpace& space, const ConnectionMotion& end,
                                   const ConnectionMotion& start, const Source& first, const Source& second,
                                   const Skeleton& skeleton, const TransitionOptions& options) {
  std::optional<Join> best;
  // A seam that cannot be seen comes first, then feet above the ground.
  const auto smooth = [&](const Join& join) { return join.ratios.worst() <= options.largest_ratio; };
  const auto better = [&](const Join& a, const Join& b) {
    if (smooth(a) != smooth(b)) return smooth(a);
    return smooth(a) ? a.sink_cm < b.sink_cm : a.ratios.worst() < b.ratios.worst();
  };
  const auto consider = [&](const Connection& connection, double stretch) {
    Join join = join_by(connection, first, second, stretch, skeleton);
    if (!best || better(join, *best)) best = join;
    return options.fixed || (smooth(*best) && best->sink_cm <= options.largest_sink_cm);
  };
  std::vector<Connection> connections;
  const double window = std::min(end.length_s, start.length_s);
  for (const double shortest : {space.options().shortest_s, 0.5, 0.8, 1.2, 1.6, window}) {
    if (shortest < space.options().shortest_s || shortest > window) continue;
    const auto connection = space.connect(end, start, shortest);
    if (!connection) continue;
    connections.push_back(*connection);
    if (consider(*connection, 1)) return best;
  }
  for (const double stretch : {1.4, 2.0}) {
    for (const Connection& connection : connections) {
      if (consider(connection, stretch)) return best;
    }
  }
  return best;
}

// A quaternion's sign means nothing; from row to row it stays on its side.
void keep_sides(SampleMatrix& values) {
  for (Eigen::Index f = 1; f < values.rows(); ++f) {
    for (Eigen::Index c = travel_curves; c + 3 < values.cols(); c += 4) {
      auto q = values.row(f).segment<4>(c);
      if (q.dot(values.row(f - 1).segment<4>(c)) < 0) q *= -1;
    }
  }
}

GroundMotion compose(const GroundMotion& outer, const GroundMotion& inner) {
  const double c = std::cos(outer.turn_rad), s = std::sin(outer.turn_rad);
  return {outer.turn_rad + inner.turn_rad, outer.x_m + c * inner.x_m + s * inner.z_m,
          outer.z_m - s * inner.x_m + c * inner.z_m};
}

}  // namespace

void TransitionOptions::validate() const {
  if (!(largest_ratio > 0)) {
    throw Error(ErrorKind::usage, {.found = fmt::format("largest_ratio = {}", largest_ratio), .expected = "above 0"});
  }
  if (!(largest_sink_cm > 0)) {
    throw Error(ErrorKind::usage,
                {.found = fmt::format("largest_sink_cm = {}", largest_sink_cm), .expected = "above 0"});
  }
}

GroundMotion ground_alignment(const CurveSampler& first, std::span<const double> first_s, const CurveSampler& second,
                              std::span<const double> second_s, const Skeleton& skeleton) {
  const JointPositions a = joint_positions(clip_from_curves(poses_at(first, first_s), skeleton));
  const JointPositions b = joint_positions(clip_from_curves(poses_at(second, second_s), skeleton));
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero(), mean_b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    mean_a += a.values[i];
    mean_b += b.values[i];
  }
  mean_a /= static_cast<double>(a.values.size());
  mean_b /= static_cast<double>(a.values.size());
  double sine = 0, cosine = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    const Eigen::Vector3d p = a.values[i] - mean_a, q = b.values[i] - mean_b;
    cosine += p.x() * q.x() + p.z() * q.z();
    sine += p.x() * q.z() - p.z() * q.x();
  }
  constexpr double cm_per_m = 100;
  const double turn = std::atan2(sine, cosine);
  const double c = std::cos(turn), s = std::sin(turn);
  return {turn, (mean_a.x() - (c * mean_b.x() + s * mean_b.z())) / cm_per_m,
          (mean_a.z() - (-s * mean_b.x() + c * mean_b.z())) / cm_per_m};
}

Transition make_transition(const ConnectionSpace& space, std::span<const ClipCurves> clips, const Skeleton& skeleton,
                           const TransitionOptions& options) {
  options.validate();
  if (clips.size() < 2) {
    throw Error(ErrorKind::usage, {.found = fmt::format("{} clip", clips.size()), .expected = "two clips or more"});
  }
  std::vector<Source> sources;
  for (const ClipCurves& clip : clips) sources.emplace_back(clip, skeleton);

  Transition out;
  std::vector<double> offsets{0};  // the output's time less each motion's own
  std::vector<GroundMotion> placements{{}};
  for (std::size_t i = 0; i + 1 < clips.size(); ++i) {
    auto join = smoothest_join(space, space.end_of(clips[i]), space.start_of(clips[i + 1]), sources[i], sources[i + 1],
                               skeleton, options);
    if (!join) {
      throw Error(ErrorKind::bad_input, {.found = fmt::format("no way from {} to {} within the legal speeds",
                                                              clips[i].name, clips[i + 1].name),
                                         .expected = "clips whose ends and starts last at least the smallest overlap"});
    }
    out.begin.push_back(offsets.back() + join->connection.leave_s);
    offsets.push_back(out.begin.back() + join->duration_s - join->connection.entered_s);
    placements.push_back(compose(placements.back(), join->placement));
    out.joins.push_back(*join);
  }

  const double rate = clips[0].rate_hz;
  const double end_s = offsets.back() + sources.back().sampler.duration_s();
  constexpr double rounding = 1e-6;  // of a frame
  const int frames = static_cast<int>(std::floor(end_s * rate + rounding)) + 1;
  ClipCurves curves{.name = clips.front().name,
                    .rate_hz = rate,
                    .placement = clips[0].placement,
                    .values = SampleMatrix(frames, sources[0].sampler.curves())};
  curves.placement.start_cm.y() = 0;
  std::vector<std::vector<FramePart>> parts;
  Eigen::RowVectorXd pose(curves.values.cols());
  std::size_t at = 0;  // the motion that plays, or that is being left
  std::optional<JoinedPair> pair;
  for (int f = 0; f < frames; ++f) {
    const double t = f / rate;
    while (at < out.joins.size() && t >= out.begin[at] + out.joins[at].duration_s) {
      pair.reset();
      ++at;
    }
    if (at < out.joins.size() && t > out.begin[at]) {
      if (!pair) pair.emplace(sources[at].sampler, sources[at + 1].sampler, out.joins[at]);
      const auto shares = pair->at(t - out.begin[at], pose);
      parts.push_back({{at, shares.first_s, 1 - shares.second}, {at + 1, shares.second_s, shares.second}});
    } else {
      // Where a frame is a frame of the motion, it is that frame to the last bit.
      const double own = (t - offsets[at]) * sources[at].sampler.rate_hz();
      const double nearest = std::round(own);
      const double own_s = (std::abs(own - nearest) < rounding ? nearest : own) / sources[at].sampler.rate_hz();
      sources[at].sampler.at(own_s, pose);
      parts.push_back({{at, own_s, 1}});
    }
    placements[at].apply(pose);
    curves.values.row(f) = pose;
  }
  keep_sides(curves.values);
  curves.side_tracks = blend_side_tracks(clips, parts, skeleton);
  for (const ClipCurves& clip : clips.subspan(1)) curves.name += "+" + clip.name;
  out.clip = clip_from_curves(curves, skeleton);
  return out;
}

}  // namespace kinespace
