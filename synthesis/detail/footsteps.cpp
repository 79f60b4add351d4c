#include "kinespace/synthesis/detail/footsteps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kinespace/footskate/guided_feet.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

using Eigen::Vector3d;

constexpr double held_cm = 2.5;      // a foot whose places are no farther apart stays where it is
constexpr double step_base_s = 0.2;  // how long a step takes, and how much longer for its way
constexpr double step_cm_s = 250;
constexpr double longest_step_s = 0.35;
constexpr double settle_s = 0.5;  // in which a held foot's offset goes after its stance

double eased(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

double ground_distance(const Vector3d& a, const Vector3d& b) {
  return std::hypot(a.x() - b.x(), a.z() - b.z());
}

int frames_for(double way_cm, double rate_hz, double pace) {
  const double lasts_s = pace * std::min(step_base_s + way_cm / step_cm_s, longest_step_s);
  return std::max(2, static_cast<int>(std::ceil(lasts_s * rate_hz)));
}

// How a leg changes over at a frame of the overlap.
LegSteps change_at(const SeamFeet& feet, int leg, int change, double pace) {
  const auto& first = feet.first.stands[leg];
  const auto& second = feet.second.stands[leg];
  LegSteps out{.last_of_first = change - 1, .first_of_second = change};
  while (out.last_of_first >= feet.begin && first[out.last_of_first] == 0) --out.last_of_first;
  while (out.first_of_second < feet.end && second[out.first_of_second] == 0) ++out.first_of_second;
  out.last_of_first = std::max(out.last_of_first, 0);
  out.first_of_second = std::min(out.first_of_second, feet.frames - 1);
  const bool leaves = first[out.last_of_first] != 0;
  const bool lands = second[out.first_of_second] != 0;
  out.way_cm = ground_distance(feet.first.ankles[leg][out.last_of_first].position,
                               feet.second.ankles[leg][out.first_of_second].position);
  out.held = leaves && lands && out.first_of_second - out.last_of_first <= 1 && out.way_cm <= held_cm;
  if (out.held || !leaves || !lands) return out;
  // A step that would be too short takes from both stances, as far as there is something to take.
  const int wanted = frames_for(out.way_cm, feet.rate_hz, pace);
  for (bool earlier = true; out.first_of_second - out.last_of_first < wanted; earlier = !earlier) {
    const bool can_leave = out.last_of_first > 0;
    const bool can_land = out.first_of_second + 1 < feet.frames;
    if (!can_leave && !can_land) break;
    if ((earlier && can_leave) || !can_land) {
      --out.last_of_first;
    } else {
      ++out.first_of_second;
    }
  }
  return out;
}

bool stands_in_plan(const SeamFeet& feet, const LegSteps& steps, int leg, int frame) {
  if (steps.held && frame >= steps.last_of_first && frame <= steps.first_of_second) return true;
  if (frame <= steps.last_of_first) return feet.first.stands[leg][frame] != 0;
  return frame >= steps.first_of_second && feet.second.stands[leg][frame] != 0;
}

// What a way costs that no motion has: of a step taken from stances, of a foot that is held away from its place.
double cost_of(const SeamFeet& feet, int leg, int change, const LegSteps& steps) {
  const auto taken = [&](int from, int to, const std::vector<char>& stands) {
    int count = 0;
    for (int f = from; f < to; ++f) count += stands[f];
    return count / feet.rate_hz;
  };
  double cost = 2 * (taken(steps.last_of_first + 1, change, feet.first.stands[leg]) +
                     taken(change, std::min(steps.first_of_second, feet.frames), feet.second.stands[leg]));
  cost += steps.held ? steps.way_cm / 20 : 0;
  // A swing that is quicker than a step should be.
  const double lacking = frames_for(steps.way_cm, feet.rate_hz, 1) - (steps.first_of_second - steps.last_of_first);
  if (!steps.held) cost += 5 * std::max(0.0, lacking) / feet.rate_hz;
  // Changing over where both motions count is best.
  const double middle = 0.5 * (feet.begin + feet.end);
  return cost + 0.2 * std::abs(change - middle) / std::max(1, feet.end - feet.begin);
}

double unsupported_s(const SeamFeet& feet, const std::array<LegSteps, 2>& legs) {
  int count = 0;
  for (int f = 0; f < feet.frames; ++f) {
    if (stands_in_plan(feet, legs[0], 0, f) || stands_in_plan(feet, legs[1], 1, f)) continue;
    const bool of_first = f < feet.end && (feet.first.stands[0][f] != 0 || feet.first.stands[1][f] != 0);
    const bool of_second = f >= feet.begin && (feet.second.stands[0][f] != 0 || feet.second.stands[1][f] != 0);
    const double share = std::clamp((f - feet.begin + 0.5) / std::max(1, feet.end - feet.begin), 0.0, 1.0);
    count += (share < 0.5 ? of_first : of_second) ? 1 : 0;
  }
  return count / feet.rate_hz;
}

Vector3d rotation_vector_of(Eigen::Quaterniond q) {
  if (q.w() < 0) q.coeffs() *= -1;
  const double sine = q.vec().norm();
  return sine < 1e-12 ? Vector3d(2 * q.vec()) : Vector3d(2 * std::atan2(sine, q.w()) / sine * q.vec());
}

// Fills one leg's task: what differs from the blend.
class LegTask {
 public:
  LegTask(const SeamFeet& feet, int leg, const LegSteps& steps, const std::vector<JointFrame>& blend)
      : feet_(feet), leg_(leg), steps_(steps), blend_(blend) {
    const auto frames = static_cast<std::size_t>(feet.frames);
    task_ = {.planted = std::vector<char>(frames, 0),
             .flat = std::vector<char>(frames, 0),
             .turn = std::vector<Vector3d>(frames, Vector3d::Zero()),
             .displacement = std::vector<Vector3d>(frames, Vector3d::Zero()),
             .lift = std::vector<double>(frames, 0)};
  }

  FootTask make() {
    for (int f = 0; f <= steps_.last_of_first; ++f) {
      if (f < feet_.begin || feet_.first.stands[leg_][f] != 0) give(f, feet_.first.ankles[leg_][f]);
    }
    int f = steps_.first_of_second;
    if (steps_.held) f = keep_held();
    for (; f < feet_.frames; ++f) {
      if (f >= feet_.end || feet_.second.stands[leg_][f] != 0) give(f, feet_.second.ankles[leg_][f]);
    }
    if (!steps_.held) lift_step();
    join_between(task_.planted, feet_.rate_hz, task_.turn);
    return std::move(task_);
  }

 private:
  void give(int frame, const JointFrame& goal) {
    task_.planted[frame] = 1;
    task_.displacement[frame] = goal.position - blend_[frame].position;
    task_.turn[frame] = rotation_vector_of(goal.rotation * blend_[frame].rotation.conjugate());
  }

  // The stance goes on where it is, on the second motion's foot plus what it is away from it; returns the frame from which
  // on the foot does what the second motion's does.
  int keep_held() {
    const JointFrame& from = feet_.first.ankles[leg_][steps_.last_of_first];
    const JointFrame& to = feet_.second.ankles[leg_][steps_.first_of_second];
    const Vector3d away = from.position - to.position;
    const Vector3d turned = rotation_vector_of(from.rotation * to.rotation.conjugate());
    const int turn_frames = std::max(1, static_cast<int>(settle_s * feet_.rate_hz));
    int last = steps_.first_of_second;
    while (last + 1 < feet_.frames && feet_.second.stands[leg_][last + 1] != 0) ++last;
    // A stance that outlasts what is looked at, or leaves no time after it, lets go of its offset slowly.
    const bool outlasts = last + 1 + turn_frames >= feet_.frames;
    const int fade_from = std::max(steps_.first_of_second, feet_.end);
    for (int f = steps_.first_of_second; f <= last; ++f) {
      const double turn_share = 1 - eased(static_cast<double>(f - steps_.first_of_second) / turn_frames);
      const double share =
          outlasts ? 1 - eased(static_cast<double>(f - fade_from) / std::max(1, last - fade_from)) : 1.0;
      JointFrame goal = feet_.second.ankles[leg_][f];
      goal.position += share * away;
      const double angle = turn_share * turned.norm();
      if (angle > 0) goal.rotation = Eigen::AngleAxisd(angle, turned.normalized()) * goal.rotation;
      give(f, goal);
    }
    return outlasts ? last + 1 : last + 1 + turn_frames;
  }

  // A foot that goes from one place to another is lifted at least so high in the middle of its way.
  void lift_step() {
    const int from = steps_.last_of_first, to = steps_.first_of_second;
    if (to - from < 2 || feet_.first.stands[leg_][from] == 0 || feet_.second.stands[leg_][to] == 0) return;
    if (from >= feet_.end || to < feet_.begin) return;
    const double wanted = std::min(2 + 0.12 * steps_.way_cm, 8.0);
    const int middle = (from + to) / 2;
    const double stand = std::max(blend_[from].position.y(), blend_[to].position.y());
    const double lacking = wanted - (blend_[middle].position.y() - stand);
    if (lacking <= 0) return;
    for (int f = from; f <= to; ++f) {
      const double x = 2.0 * (f - from) / (to - from) - 1;
      const double shape = 1 - x * x;
      task_.lift[f] = lacking * shape * shape * shape;
    }
  }

  const SeamFeet& feet_;
  int leg_;
  const LegSteps& steps_;
  const std::vector<JointFrame>& blend_;
  FootTask task_;
};

}  // namespace

Footsteps plan_footsteps(const SeamFeet& feet, double pace) {
  std::array<std::vector<LegSteps>, 2> ways;
  std::array<std::vector<double>, 2> costs;
  constexpr int changes_tried = 24;
  const int apart = std::max(1, (feet.end - feet.begin) / changes_tried);
  for (int leg = 0; leg < 2; ++leg) {
    for (int change = std::max(1, feet.begin); change <= std::min(feet.end, feet.frames - 1); change += apart) {
      ways[leg].push_back(change_at(feet, leg, change, pace));
      costs[leg].push_back(cost_of(feet, leg, change, ways[leg].back()));
    }
  }
  Footsteps best{.cost = std::numeric_limits<double>::infinity()};
  for (std::size_t left = 0; left < ways[0].size(); ++left) {
    for (std::size_t right = 0; right < ways[1].size(); ++right) {
      const double plain = costs[0][left] + costs[1][right];
      if (plain >= best.cost) continue;
      const std::array<LegSteps, 2> legs{ways[0][left], ways[1][right]};
      const double cost = plain + 5 * unsupported_s(feet, legs);
      if (cost < best.cost) best = {.legs = legs, .cost = cost};
    }
  }
  return best;
}

void take_footsteps(Clip& blend, const FootTracks& tracks, const Ground& ground, const SeamFeet& feet,
                    const Footsteps& plan) {
  const auto ankles = ankles_of(blend, tracks.feet);
  GuidedFeet guide{
      .tasks = {LegTask(feet, 0, plan.legs[0], ankles[0]).make(), LegTask(feet, 1, plan.legs[1], ankles[1]).make()},
      .root_share = {}};
  // The root is at home at both ends of what is looked at, also where that is the overlap alone.
  const int inside = std::min(static_cast<int>(0.15 * feet.rate_hz), (feet.end - feet.begin) / 2);
  const double coming = std::max({1, feet.begin, inside});
  const double going = std::max({1, feet.frames - feet.end, inside});
  for (int f = 0; f < feet.frames; ++f) {
    guide.root_share.push_back(eased(std::min({f / coming, (feet.frames - 1 - f) / going, 1.0})));
  }
  guide_feet(blend, tracks, ground, guide);
}

std::array<std::vector<JointFrame>, 2> ankles_of(const Clip& clip, const Feet& feet) {
  std::array<std::vector<JointFrame>, 2> out;
  std::vector<JointFrame> world;
  for (int f = 0; f < clip.frames; ++f) {
    world_frames(clip, f, world);
    for (std::size_t leg = 0; leg < 2; ++leg) out[leg].push_back(world[static_cast<std::size_t>(feet.legs[leg].ankle)]);
  }
  return out;
}

}  // namespace kinespace
