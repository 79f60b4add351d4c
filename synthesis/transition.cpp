#include "kinespace/synthesis/transition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/footskate/contact_model.h"
#include "kinespace/footskate/kept_feet.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/synthesis/curve_sampler.h"
#include "kinespace/synthesis/detail/footsteps.h"
#include "kinespace/synthesis/detail/joined_pair.h"
#include "kinespace/synthesis/detail/side_track_blend.h"

namespace kinespace {
namespace {

ClipCurves poses_at(const CurveSampler& sampler, std::span<const double> times) {
  ClipCurves out{.rate_hz = 1, .values = SampleMatrix(static_cast<Eigen::Index>(times.size()), sampler.curves())};
  for (std::size_t i = 0; i < times.size(); ++i) sampler.at(times[i], out.values.row(static_cast<Eigen::Index>(i)));
  return out;
}

// Heights are of the world: clips keep theirs where they are joined.
ClipCurves at_world_height(ClipCurves curves) {
  curves.values.col(1).array() += curves.placement.start_cm.y() / 100;
  curves.placement.start_cm.y() = 0;
  return curves;
}

// What is asked of the sources again and again.
struct Source {
  Source(const ClipCurves& curves, const Skeleton& skeleton, const std::optional<FootContacts>& known, bool plan_feet)
      : sampler(at_world_height(curves)) {
    const Clip clip = clip_from_curves(curves, skeleton);
    rates = joint_rates(clip);
    feet = find_feet(clip);
    if (!feet) return;
    const FootTracks tracks = foot_tracks(clip, *feet);
    level = foot_level(tracks);
    motion = foot_motion(tracks, level);
    // Finding contacts takes memory that grows with the clip.
    contacts_known =
        plan_feet && clip.rate_hz >= least_contact_rate_hz && (known || clip.frames <= most_frames_with_feet);
    if (!contacts_known) return;
    const FootContacts contacts = known ? *known : ContactModel::standard().detect(tracks, level.ground);
    for (int leg = 0; leg < 2; ++leg) {
      stands[leg] = planted_frames(contacts, 2 * leg, clip.frames);
      const auto toe = planted_frames(contacts, 2 * leg + 1, clip.frames);
      for (int f = 0; f < clip.frames; ++f) stands[leg][f] = static_cast<char>(stands[leg][f] | toe[f]);
    }
  }

  [[nodiscard]] bool stands_at(int leg, double time_s) const {
    const auto frame = std::llround(time_s * sampler.rate_hz());
    return stands[leg][std::clamp<std::ptrdiff_t>(frame, 0, std::ssize(stands[leg]) - 1)] != 0;
  }

  CurveSampler sampler;
  JointRates rates;
  std::optional<Feet> feet;
  FootLevel level;
  FootMotion motion;
  bool contacts_known = false;
  std::array<std::vector<char>, 2> stands;  // by leg, whether ankle or toe stands
};

// How many frames before and after an overlap may change so that the feet stay where they are.
struct Margins {
  int before = 0, after = 0;
};

// Joins two motions and measures what comes out.
class Joiner {
 public:
  Joiner(const Source& first, const Source& second, const Skeleton& skeleton, double least_leave_s,
         double largest_entered_s)
      : first_(first),
        second_(second),
        skeleton_(skeleton),
        least_leave_s_(least_leave_s),
        largest_entered_s_(largest_entered_s) {}

  // Output frames around an overlap that began `phase_s` before the first of them that is inside.
  struct Seam {
    ClipCurves curves;
    int begin = 0, end = 0;  // the overlap's frames
    std::optional<FootTracks> tracks;
    bool feet_planned = false;
  };

  [[nodiscard]] Seam seam_of(const Join& join, double phase_s, bool plan_feet) const {
    const double rate = first_.sampler.rate_hz();
    const Margins margins = margins_of(join);
    Seam out{.begin = margins.before};
    out.end = out.begin + static_cast<int>(std::floor((join.duration_s - phase_s) * rate + 1e-9)) + 1;
    const int frames = out.end + margins.after;
    JoinedPair pair(first_.sampler, second_.sampler, join);
    out.curves = empty_curves(frames);
    Eigen::RowVectorXd pose(first_.sampler.curves());
    std::vector<JoinedPair::Shares> shares;
    for (int f = 0; f < frames; ++f) {
      shares.push_back(pair.at(phase_s + (f - out.begin) / rate, pose));
      out.curves.values.row(f) = pose;
    }
    if (!first_.feet) return out;
    Clip clip = clip_from_curves(out.curves, skeleton_);
    out.tracks = foot_tracks(clip, *first_.feet);
    if (!plan_feet || !first_.contacts_known || !second_.contacts_known) return out;
    const SeamFeet feet = feet_over(pair, shares, out, rate);
    const Footsteps plan = plan_footsteps(feet, join.pace);
    take_footsteps(clip, *out.tracks, first_.level.ground, feet, plan);
    out.feet_planned = put_legs(clip, out.curves);
    if (out.feet_planned) out.tracks = foot_tracks(clip, *first_.feet);
    return out;
  }

  [[nodiscard]] Join measured(Join join, bool plan_feet) const {
    const double step = 1 / first_.sampler.rate_hz();
    // The output's frames are those of the first motion, so the overlap begins between two of them.
    const double phase = std::ceil(join.connection.leave_s / step - 1e-9) * step - join.connection.leave_s;
    const Seam seam = seam_of(join, phase, plan_feet);
    const std::array<const JointRates*, 2> sources{&first_.rates, &second_.rates};
    const double begin_s = seam.begin * step - phase;
    const Clip clip = clip_from_curves(seam.curves, skeleton_);
    join.ratios = seam_ratios(joint_rates(clip), begin_s, begin_s + join.duration_s, usual_rates(sources));
    join.feet_planned = seam.feet_planned;
    if (seam.tracks) {
      join.feet = foot_motion(*seam.tracks, first_.level, seam.begin, seam.end - 1);
      join.feet_of_sources = mean_motion(first_.motion, second_.motion);
    }
    return join;
  }

  // Placements for which feet that stand in both motions at once stand in one place: of the left foot, the right one,
  // and between both.
  [[nodiscard]] std::vector<GroundMotion> placements_by_feet(const Join& join) const {
    std::vector<GroundMotion> out;
    if (!first_.contacts_known || !second_.contacts_known) return out;
    const double rate = first_.sampler.rate_hz();
    JoinedPair pair(first_.sampler, second_.sampler, join);
    Seam seam{.begin = 0, .end = static_cast<int>(join.duration_s * rate) + 1};
    seam.curves = empty_curves(seam.end);
    Eigen::RowVectorXd pose(first_.sampler.curves());
    std::vector<JoinedPair::Shares> shares;
    for (int f = 0; f < seam.end; ++f) shares.push_back(pair.at(f / rate, pose));
    const SeamFeet feet = feet_over(pair, shares, seam, rate);
    Eigen::Vector3d both = Eigen::Vector3d::Zero();
    for (int leg = 0; leg < 2; ++leg) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      int count = 0;
      for (int f = 0; f < feet.frames; ++f) {
        if (feet.first.stands[leg][f] == 0 || feet.second.stands[leg][f] == 0) continue;
        sum += feet.first.ankles[leg][f].position - feet.second.ankles[leg][f].position;
        ++count;
      }
      if (count == 0) continue;
      sum /= 100.0 * count;
      both += sum / 2;
      out.push_back(moved(join.placement, sum));
    }
    if (out.size() == 2) out.push_back(moved(join.placement, both));
    return out;
  }

 private:
  static GroundMotion moved(const GroundMotion& by, const Eigen::Vector3d& further_m) {
    return {by.turn_rad, by.x_m + further_m.x(), by.z_m + further_m.z()};
  }

  // Room for the root and the feet to come back to the motions themselves; no seam reaches into its neighbour's.
  [[nodiscard]] Margins margins_of(const Join& join) const {
    constexpr double before_s = 0.4, after_s = 1.0;
    const double rate = first_.sampler.rate_hz();
    const double before = std::clamp(join.connection.leave_s - least_leave_s_, 0.0, before_s);
    const double after = std::clamp(largest_entered_s_ - join.connection.entered_s, 0.0, after_s);
    return {static_cast<int>(before * rate), static_cast<int>(after * rate)};
  }

  [[nodiscard]] ClipCurves empty_curves(int frames) const {
    return {.rate_hz = first_.sampler.rate_hz(), .values = SampleMatrix(frames, first_.sampler.curves())};
  }

  [[nodiscard]] SeamFeet feet_over(const JoinedPair& pair, const std::vector<JoinedPair::Shares>& shares,
                                   const Seam& seam, double rate_hz) const {
    SeamFeet out{.frames = seam.curves.frames(), .begin = seam.begin, .end = seam.end, .rate_hz = rate_hz};
    ClipCurves first = empty_curves(out.frames), second = empty_curves(out.frames);
    Eigen::RowVectorXd pose(first.values.cols());
    for (int f = 0; f < out.frames; ++f) {
      pair.first_at(shares[f].first_s, pose);
      first.values.row(f) = pose;
      pair.second_at(shares[f].second_s, pose);
      second.values.row(f) = pose;
    }
    out.first.ankles = ankles_of(clip_from_curves(first, skeleton_), *first_.feet);
    out.second.ankles = ankles_of(clip_from_curves(second, skeleton_), *first_.feet);
    for (int leg = 0; leg < 2; ++leg) {
      for (int f = 0; f < out.frames; ++f) {
        out.first.stands[leg].push_back(first_.stands_at(leg, shares[f].first_s) ? 1 : 0);
        out.second.stands[leg].push_back(f >= seam.begin && second_.stands_at(leg, shares[f].second_s) ? 1 : 0);
      }
    }
    return out;
  }

  // What the clip's legs and root are, into the curves; false where the curves have no such joint.
  [[nodiscard]] bool put_legs(const Clip& clip, ClipCurves& curves) const {
    const std::vector<int> rotating = skeleton_.rotating_joints();
    std::vector<std::pair<int, Eigen::Index>> columns;
    for (const Leg& leg : first_.feet->legs) {
      for (const int joint : {leg.hip, leg.knee, leg.ankle}) {
        const auto found = std::ranges::find(rotating, joint);
        if (found == rotating.end()) return false;
        columns.emplace_back(joint, travel_curves + 4 * (found - rotating.begin()));
      }
    }
    const int root = skeleton_.travel_root();
    for (int f = 0; f < clip.frames; ++f) {
      for (const auto& [joint, column] : columns) {
        const Eigen::Quaterniond q = clip.rotation(joint, f);
        curves.values.row(f).segment<4>(column) << q.w(), q.x(), q.y(), q.z();
      }
      curves.values.row(f).head<travel_curves>() = clip.translation(root, f).transpose() / 100;
    }
    return true;
  }

  static FootMotion mean_motion(const FootMotion& a, const FootMotion& b) {
    const auto mean = [](const std::optional<double>& x, const std::optional<double>& y) -> std::optional<double> {
      if (!x || !y) return x ? x : y;
      return (*x + *y) / 2;
    };
    return {.slide_cm_s = mean(a.slide_cm_s, b.slide_cm_s),
            .lowest_speed_cm_s = mean(a.lowest_speed_cm_s, b.lowest_speed_cm_s),
            .penetration_cm = std::max(a.penetration_cm, b.penetration_cm),
            .hover_cm = (a.hover_cm + b.hover_cm) / 2};
  }

  const Source& first_;
  const Source& second_;
  const Skeleton& skeleton_;
  double least_leave_s_;      // from there on the first motion may change
  double largest_entered_s_;  // up to there the second
};

// How much worse a joined motion is than its sources: 0 where nothing can be seen.
double badness(const Join& join) {
  const auto over = [](double ratio, double allowed) { return std::max(0.0, ratio - allowed); };
  double out = 3 * over(join.ratios.speed, 1) + 3 * over(join.ratios.acceleration, 1) +
               over(join.ratios.root_acceleration, 1) + 2 * over(join.ratios.root_acceleration, 1.4);
  out += 0.2 * (join.ratios.worst() + join.ratios.root_acceleration);
  if (join.feet) {
    const FootMotion& feet = *join.feet;
    const FootMotion& usual = *join.feet_of_sources;
    constexpr double seen_cm_s = 2;  // slower than this nobody sees
    const double slide = feet.slide_cm_s.value_or(0) / std::max(seen_cm_s, usual.slide_cm_s.value_or(0));
    const double lowest = feet.lowest_speed_cm_s.value_or(0) / std::max(seen_cm_s, usual.lowest_speed_cm_s.value_or(0));
    out += 0.5 * slide + over(slide, 1.2) + 0.2 * lowest + 0.3 * over(lowest, 1.2);
    out += over(feet.penetration_cm - usual.penetration_cm, 1) / 3;
  }
  return out + 0.3 * std::abs(std::log2(join.connection.speed())) + join.connection.cost_cm / 50 +
         0.3 * (join.stretch - 1);
}

Join blended_join(const Connection& connection, const Source& first, const Source& second, double stretch,
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
  return join;
}

// From the middle of a connection on the second motion, after `duration_s` as it is; nullopt where it is too short.
std::optional<Join> inertialized_join(const Connection& connection, const Source& first, const Source& second,
                                      double duration_s, const Skeleton& skeleton) {
  const double step = 1 / first.sampler.rate_hz();
  const double leave = std::floor((connection.leave_s + connection.left_s) / 2 / step) * step;
  const double ahead = std::round((connection.enter_s + connection.entered_s) / 2 / step) * step;
  const double duration = std::max(1.0, std::round(duration_s / step)) * step;
  if (ahead + duration > second.sampler.duration_s() / 2 + 1e-9 || leave <= 0) return std::nullopt;
  Join join{.connection = connection, .way = JoinWay::inertialization, .duration_s = duration};
  join.connection.leave_s = leave;
  join.connection.left_s = leave + duration;
  join.connection.enter_s = ahead;
  join.connection.entered_s = ahead + duration;
  const std::array<double, 1> at_first{leave}, at_second{ahead};
  join.placement = ground_alignment(first.sampler, at_first, second.sampler, at_second, skeleton);
  return join;
}

// Tries joins and keeps the best.
class BestJoin {
 public:
  BestJoin(const Joiner& joiner, bool plan_feet) : joiner_(joiner), plan_feet_(plan_feet) {}

  void consider(const Join& plain) {
    const Join join = joiner_.measured(plain, plan_feet_);
    tried_.emplace_back(badness(join), join);
    if (!best_ || tried_.back().first < tried_[*best_].first) best_ = tried_.size() - 1;
  }

  // Whether something can still be seen of the seam: then it is worth while to look further.
  [[nodiscard]] bool can_be_seen() const {
    if (!best_) return false;
    const Join& join = tried_[*best_].second;
    if (join.ratios.worst() > 1 || join.ratios.root_acceleration > 1.2) return true;
    if (!join.feet) return false;
    constexpr double seen_cm_s = 2;
    return join.feet->slide_cm_s.value_or(0) > 1.5 * std::max(seen_cm_s, join.feet_of_sources->slide_cm_s.value_or(0));
  }

  // The best of those tried so far, each once more with what `vary` makes of it.
  template <typename Vary>
  void vary_best(std::size_t count, const Vary& vary) {
    std::vector<std::size_t> order(tried_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return tried_[i].first; });
    order.resize(std::min(count, order.size()));
    std::vector<Join> chosen;
    for (const std::size_t i : order) chosen.push_back(tried_[i].second);
    for (const Join& join : chosen) {
      for (const Join& varied : vary(join)) consider(varied);
    }
  }

  [[nodiscard]] std::optional<Join> best() const { return best_ ? std::optional(tried_[*best_].second) : std::nullopt; }

 private:
  const Joiner& joiner_;
  bool plan_feet_;
  std::vector<std::pair<double, Join>> tried_;
  std::optional<std::size_t> best_;
};

std::optional<Join> best_join(const ConnectionSpace& space, const ConnectionMotion& end, const ConnectionMotion& start,
                              const Source& first, const Source& second, const Skeleton& skeleton, const Joiner& joiner,
                              const TransitionOptions& options) {
  BestJoin search(joiner, options.plan_feet);
  std::vector<Connection> connections;
  const double window = std::min(end.length_s, start.length_s);
  for (const double shortest : {space.options().shortest_s, 0.5, 0.8, 1.2, 1.6, window}) {
    if (shortest < space.options().shortest_s || shortest > window) continue;
    auto connection = space.connect(end, start, shortest, {.largest_speed = options.largest_speed});
    if (!connection) connection = space.connect(end, start, shortest);
    if (connection) connections.push_back(*connection);
  }
  const auto try_all = [&](std::span<const double> stretches, std::span<const double> durations_s) {
    for (const Connection& connection : connections) {
      for (const double stretch : stretches) {
        if (options.way == JoinWay::inertialization) break;
        search.consider(blended_join(connection, first, second, stretch, skeleton));
      }
      for (const double duration : durations_s) {
        if (options.way == JoinWay::blend) break;
        const auto join = inertialized_join(connection, first, second, duration, skeleton);
        if (join) search.consider(*join);
      }
    }
  };
  constexpr std::array<double, 2> usual_stretches{1.0, 1.25}, more_stretches{1.6, 2.0};
  constexpr std::array<double, 3> usual_durations_s{0.3, 0.5, 0.8};
  constexpr std::array<double, 2> more_durations_s{1.1, 1.5};
  try_all(usual_stretches, usual_durations_s);
  constexpr std::size_t varied = 4;
  if (options.plan_feet && search.can_be_seen()) {
    search.vary_best(varied, [&](const Join& join) {
      std::vector<Join> out;
      for (const GroundMotion& placement : joiner.placements_by_feet(join)) {
        out.push_back(join);
        out.back().placement = placement;
      }
      return out;
    });
  }
  if (search.can_be_seen()) try_all(more_stretches, more_durations_s);
  if (options.plan_feet && search.can_be_seen()) {
    search.vary_best(varied, [](Join join) {
      std::vector<Join> out;
      for (const double pace : {1.6, 2.4}) {
        join.pace = pace;
        out.push_back(join);
      }
      return out;
    });
  }
  return search.best();
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

// The motions that are joined, in their order.
struct Cast {
  Cast(std::span<const ClipCurves> of_clips, const Skeleton& of_skeleton,
       std::span<const std::optional<FootContacts>> contacts, bool plan_feet)
      : clips(of_clips), skeleton(of_skeleton) {
    sources.reserve(clips.size());
    for (std::size_t i = 0; i < clips.size(); ++i) {
      sources.emplace_back(clips[i], skeleton, i < contacts.size() ? contacts[i] : std::nullopt, plan_feet);
    }
  }

  // Of motion i and the next. A motion is entered in its first half and left in its second.
  [[nodiscard]] Joiner joiner(std::size_t i) const {
    const double length = sources[i + 1].sampler.duration_s();
    return {sources[i], sources[i + 1], skeleton, i == 0 ? 0 : sources[i].sampler.duration_s() / 2,
            i + 2 == clips.size() ? length : length / 2};
  }

  std::span<const ClipCurves> clips;
  const Skeleton& skeleton;
  std::vector<Source> sources;
};

// The whole of it, played.
class Film {
 public:
  Film(const Cast& cast, std::span<const Join> joins) : cast_(cast) {
    out_.joins.assign(joins.begin(), joins.end());
    for (const Join& join : joins) {
      out_.begin.push_back(offsets_.back() + join.connection.leave_s);
      offsets_.push_back(out_.begin.back() + join.duration_s - join.connection.entered_s);
      placements_.push_back(compose(placements_.back(), join.placement));
    }
  }

  Transition play() {
    const double rate = cast_.clips[0].rate_hz;
    const double end_s = offsets_.back() + cast_.sources.back().sampler.duration_s();
    const int frames = static_cast<int>(std::floor(end_s * rate + rounding)) + 1;
    ClipCurves curves{.name = cast_.clips.front().name,
                      .rate_hz = rate,
                      .placement = cast_.clips[0].placement,
                      .values = SampleMatrix(frames, cast_.sources[0].sampler.curves())};
    curves.placement.start_cm.y() = 0;
    const auto parts = play_motions(curves);
    for (std::size_t i = 0; i < out_.joins.size(); ++i) put_planned_feet(i, curves);
    keep_sides(curves.values);
    curves.side_tracks = blend_side_tracks(cast_.clips, parts, cast_.skeleton);
    for (const ClipCurves& clip : cast_.clips.subspan(1)) curves.name += "+" + clip.name;
    out_.clip = clip_from_curves(curves, cast_.skeleton);
    return std::move(out_);
  }

 private:
  static constexpr double rounding = 1e-6;  // of a frame

  // Without any planned feet; returns what each frame is made of.
  std::vector<std::vector<FramePart>> play_motions(ClipCurves& curves) const {
    std::vector<std::vector<FramePart>> parts;
    Eigen::RowVectorXd pose(curves.values.cols());
    std::size_t at = 0;  // the motion that plays, or that is being left
    std::optional<JoinedPair> pair;
    for (int f = 0; f < curves.frames(); ++f) {
      const double t = f / curves.rate_hz;
      while (at < out_.joins.size() && t >= out_.begin[at] + out_.joins[at].duration_s) {
        pair.reset();
        ++at;
      }
      if (at < out_.joins.size() && t > out_.begin[at]) {
        if (!pair) pair.emplace(cast_.sources[at].sampler, cast_.sources[at + 1].sampler, out_.joins[at]);
        const auto shares = pair->at(t - out_.begin[at], pose);
        parts.push_back({{at, shares.first_s, 1 - shares.second}, {at + 1, shares.second_s, shares.second}});
      } else {
        // Where a frame is a frame of the motion, it is that frame to the last bit.
        const CurveSampler& sampler = cast_.sources[at].sampler;
        const double own = (t - offsets_[at]) * sampler.rate_hz();
        const double nearest = std::round(own);
        const double own_s = (std::abs(own - nearest) < rounding ? nearest : own) / sampler.rate_hz();
        sampler.at(own_s, pose);
        parts.push_back({{at, own_s, 1}});
      }
      placements_[at].apply(pose);
      curves.values.row(f) = pose;
    }
    return parts;
  }

  void put_planned_feet(std::size_t i, ClipCurves& curves) const {
    if (!out_.joins[i].feet_planned) return;
    const int first_inside = static_cast<int>(std::ceil(out_.begin[i] * curves.rate_hz - rounding));
    const auto seam = cast_.joiner(i).seam_of(out_.joins[i], first_inside / curves.rate_hz - out_.begin[i], true);
    Eigen::RowVectorXd pose(curves.values.cols());
    for (int f = 0; f < seam.curves.frames(); ++f) {
      const int to = first_inside + f - seam.begin;
      if (to < 0 || to >= curves.frames()) continue;
      pose = seam.curves.values.row(f);
      placements_[i].apply(pose);
      curves.values.row(to) = pose;
    }
  }

  const Cast& cast_;
  Transition out_;
  std::vector<double> offsets_{0};  // the output's time less each motion's own
  std::vector<GroundMotion> placements_{{}};
};

}  // namespace

std::string_view to_string(JoinWay way) {
  return way == JoinWay::blend ? "blend" : "inertialization";
}

void TransitionOptions::validate() const {
  if (largest_speed >= 1 && largest_speed <= 2) return;
  throw Error(ErrorKind::usage,
              {.found = fmt::format("largest_speed = {}", largest_speed), .expected = "1 to 2", .remedy = {}});
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

Transition play_joins(std::span<const ClipCurves> clips, std::span<const Join> joins, const Skeleton& skeleton,
                      std::span<const std::optional<FootContacts>> contacts) {
  if (clips.empty() || joins.size() + 1 != clips.size()) {
    throw Error(ErrorKind::usage, {.found = fmt::format("{} joins for {} clips", joins.size(), clips.size()),
                                   .expected = "one between each two clips"});
  }
  const Cast cast(clips, skeleton, contacts, std::ranges::any_of(joins, &Join::feet_planned));
  return Film(cast, joins).play();
}

Transition make_transition(const ConnectionSpace& space, std::span<const ClipCurves> clips, const Skeleton& skeleton,
                           const TransitionOptions& options, std::span<const std::optional<FootContacts>> contacts) {
  options.validate();
  if (clips.size() < 2) {
    throw Error(ErrorKind::usage, {.found = fmt::format("{} clip", clips.size()), .expected = "two clips or more"});
  }
  const Cast cast(clips, skeleton, contacts, options.plan_feet);
  std::vector<Join> joins;
  for (std::size_t i = 0; i + 1 < clips.size(); ++i) {
    const auto join = best_join(space, space.end_of(clips[i]), space.start_of(clips[i + 1]), cast.sources[i],
                                cast.sources[i + 1], skeleton, cast.joiner(i), options);
    if (!join) {
      throw Error(ErrorKind::bad_input, {.found = fmt::format("no way from {} to {} within the legal speeds",
                                                              clips[i].name, clips[i + 1].name),
                                         .expected = "clips whose ends and starts last at least the smallest overlap"});
    }
    joins.push_back(*join);
  }
  return Film(cast, joins).play();
}

}  // namespace kinespace
