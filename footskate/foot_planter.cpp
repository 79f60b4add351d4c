#include "kinespace/footskate/foot_planter.h"

#include <algorithm>
#include <cmath>

#include "kinespace/footskate/skate_measures.h"
#include "kinespace/footskate/two_bone_ik.h"

namespace kinespace {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double hardly_cm = 1e-5;
constexpr double lowest_cm = -0.3;        // below the floor
constexpr double lift_softness_cm = 0.2;  // around lowest_cm, within which the lift begins

// 0 to 1, twice continuously differentiable.
double fade_in(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * t * (t * (6 * t - 15) + 10);
}

Vector3d world_place(const Placement& placement, const Quaterniond& turn, const Vector3d& place) {
  return placement.start_cm + turn * place;
}

// The turn of the smallest angle from one direction to another.
Quaterniond least_turn(const Vector3d& from, const Vector3d& to) {
  const double lengths = std::sqrt(from.squaredNorm() * to.squaredNorm());
  const double cosine = from.dot(to);
  if (lengths < 1e-12 || cosine < -0.999 * lengths) return Quaterniond::Identity();
  Quaterniond out(lengths + cosine, 0, 0, 0);
  out.vec() = from.cross(to);
  return out.normalized();
}

}  // namespace

FootPlanter::FootPlanter(const KeptFeet& feet, const Placement& placement, double rate_hz)
    : feet_(feet), fade_frames_(fade_s * rate_hz) {
  const Quaterniond turn(Eigen::AngleAxisd(placement.heading_rad, Vector3d::UnitY()));
  for (KeptContact& c : feet_.contacts) {
    for (KeptPlace& p : c.places) p.place = world_place(placement, turn, p.place);
    ++first_of_slot_[static_cast<std::size_t>(c.slot) + 1];
  }
  for (std::size_t slot = 1; slot < first_of_slot_.size(); ++slot) first_of_slot_[slot] += first_of_slot_[slot - 1];
  const Vector3d slope = turn * Vector3d(feet.floor_gradient.x(), 0, feet.floor_gradient.y());
  feet_.floor_gradient = {slope.x(), slope.z()};
  feet_.floor_cm = feet.floor_cm + placement.start_cm.y() - slope.dot(placement.start_cm);
}

Vector3d FootPlanter::place(int index, double frame) const {
  const std::vector<KeptPlace>& places = contact(index).places;
  auto next = places.begin() + 1;
  if (places.size() > 2) {
    next = std::upper_bound(places.begin() + 1, places.end() - 1, frame,
                            [](double f, const KeptPlace& p) { return f < p.frame; });
  }
  const KeptPlace& before = *(next - 1);
  const double share = std::clamp((frame - before.frame) / (next->frame - before.frame), 0.0, 1.0);
  return before.place + share * (next->place - before.place);
}

FootPlanter::Hold FootPlanter::hold(int slot, double frame, const Vector3d& at,
                                    std::span<const Eigen::Vector3f> ends) const {
  const auto begin = feet_.contacts.begin() + first_of_slot_[static_cast<std::size_t>(slot)];
  const auto end = feet_.contacts.begin() + first_of_slot_[static_cast<std::size_t>(slot) + 1];
  const auto next =
      std::upper_bound(begin, end, frame, [](double f, const KeptContact& c) { return f < c.first_frame(); });
  const auto index = [&](auto contact) { return static_cast<int>(contact - feet_.contacts.begin()); };
  if (next != begin && frame <= (next - 1)->last_frame()) return {1, place(index(next - 1), frame) - at};
  double span = fade_frames_;
  if (next != begin && next != end) {
    span = std::min(span, static_cast<double>(next->first_frame() - (next - 1)->last_frame()));
  }
  Hold out;
  const auto add = [&](double frames_off, std::size_t end_of_contact) {
    if (frames_off >= span) return;
    const double weight = fade_in(1 - frames_off / span);
    out.weight += weight;
    out.displacement += weight * ends[end_of_contact].cast<double>();
  };
  if (next != begin) add(frame - (next - 1)->last_frame(), 2 * static_cast<std::size_t>(index(next - 1)) + 1);
  if (next != end) add(next->first_frame() - frame, 2 * static_cast<std::size_t>(index(next)));
  return out;
}

double FootPlanter::lift(const Vector3d& at) const {
  const double over =
      at.y() - (feet_.floor_cm + feet_.floor_gradient.x() * at.x() + feet_.floor_gradient.y() * at.z()) - lowest_cm;
  if (over >= lift_softness_cm) return 0;
  if (over <= -lift_softness_cm) return -over;
  return (lift_softness_cm - over) * (lift_softness_cm - over) / (4 * lift_softness_cm);
}

FootPlanter::Goals FootPlanter::goals(int leg, double frame, const LegState& state,
                                      std::span<const Eigen::Vector3f> ends) const {
  const Hold ankle = hold(2 * leg, frame, state.ankle.position, ends);
  if (feet_.legs[static_cast<std::size_t>(leg)].toe < 0) {
    Vector3d goal = state.ankle.position + ankle.displacement;
    goal.y() += lift(goal);
    return {goal, goal};
  }
  const Hold toe = hold(2 * leg + 1, frame, state.toe, ends);
  Goals out{state.ankle.position + ankle.displacement + (1 - ankle.weight) * toe.displacement,
            state.toe + toe.displacement + (1 - toe.weight) * ankle.displacement};
  const Vector3d foot = state.toe - state.ankle.position;
  const Vector3d way = out.toe - out.ankle;
  if (way.norm() > 1e-6) {
    // Where both are held fully it is the ankle.
    const double by_toe = toe.weight * (1 - 0.97 * ankle.weight);
    const double by_ankle = ankle.weight * (1 - toe.weight);
    out.ankle += by_toe / (by_toe + by_ankle + 1e-9) * (1 - foot.norm() / way.norm()) * way;
  }
  const Vector3d turned = least_turn(foot, out.toe - out.ankle) * foot;
  const double up = std::max(lift(out.ankle), lift(out.ankle + turned));
  out.ankle.y() += up;
  out.toe.y() += up;
  return out;
}

std::optional<LegRotations> FootPlanter::plant(int leg, double frame, const LegState& state,
                                               std::span<const Eigen::Vector3f> ends) const {
  const auto [ankle, toe] = goals(leg, frame, state, ends);
  if ((ankle - state.ankle.position).norm() <= hardly_cm && (toe - state.toe).norm() <= hardly_cm) {
    return std::nullopt;
  }
  const auto side = static_cast<std::size_t>(leg);
  const TwoBoneTurn turn = reach_for({state.hip.position, state.knee.position, state.ankle.position}, ankle,
                                     {.knee_axis = state.hip.rotation * feet_.knee_axes[side]});
  Quaterniond foot = Quaterniond::Identity();
  if (feet_.legs[side].toe >= 0) foot = least_turn(state.toe - state.ankle.position, toe - turn.ankle);
  return LegRotations{
      .hip = (state.above_hip.conjugate() * turn.thigh * state.hip.rotation).normalized(),
      .knee = ((turn.thigh * state.above_knee).conjugate() * turn.shin * state.knee.rotation).normalized(),
      .ankle = ((turn.shin * state.above_ankle).conjugate() * foot * state.ankle.rotation).normalized()};
}

namespace {

LegState leg_state(const Skeleton& skeleton, const Leg& leg, const std::vector<JointFrame>& world) {
  const auto above = [&](int joint) {
    const int parent = skeleton.joints[static_cast<std::size_t>(joint)].parent;
    return parent >= 0 ? world[static_cast<std::size_t>(parent)].rotation : Quaterniond::Identity();
  };
  const auto at = [&](int joint) { return world[static_cast<std::size_t>(joint)]; };
  return {.hip = at(leg.hip),
          .knee = at(leg.knee),
          .ankle = at(leg.ankle),
          .toe = at(leg.toe >= 0 ? leg.toe : leg.ankle).position,
          .above_hip = above(leg.hip),
          .above_knee = above(leg.knee),
          .above_ankle = above(leg.ankle)};
}

void set_near(Clip& clip, int joint, int frame, Quaterniond rotation) {
  if (rotation.dot(clip.rotation(joint, frame)) < 0) rotation.coeffs() *= -1;
  clip.set_rotation(joint, frame, rotation);
}

FootPlanter::Ends ends_of(const Clip& clip, const FootPlanter& planter) {
  FootPlanter::Ends out;
  std::vector<JointFrame> world;
  const std::array<int, 4> joints = Feet{.legs = planter.feet().legs}.foot_joints();
  for (int i = 0; i < planter.contact_count(); ++i) {
    const KeptContact& c = planter.contact(i);
    for (const int frame : {c.first_frame(), c.last_frame()}) {
      world_frames(clip, frame, world);
      const Vector3d at = world[static_cast<std::size_t>(joints[static_cast<std::size_t>(c.slot)])].position;
      out.emplace_back((planter.place(i, frame) - at).cast<float>());
    }
  }
  return out;
}

}  // namespace

void plant_feet(Clip& clip, const KeptFeet& feet, const Placement& placement) {
  const FootPlanter planter(feet, placement, clip.rate_hz);
  const FootPlanter::Ends ends = ends_of(clip, planter);
  std::vector<JointFrame> world;
  for (int f = 0; f < clip.frames; ++f) {
    world_frames(clip, f, world);
    for (int side = 0; side < 2; ++side) {
      const Leg& leg = feet.legs[static_cast<std::size_t>(side)];
      const auto turned = planter.plant(side, f, leg_state(clip.skeleton, leg, world), ends);
      if (!turned) continue;
      set_near(clip, leg.hip, f, turned->hip);
      set_near(clip, leg.knee, f, turned->knee);
      set_near(clip, leg.ankle, f, turned->ankle);
    }
  }
}

FeetMeasures measure_feet(const Clip& clip, const KeptFeet& feet, const Placement& placement) {
  const FootPlanter planter(feet, placement, clip.rate_hz);
  const FootTracks tracks = foot_tracks(clip, {.legs = feet.legs, .root = clip.skeleton.travel_root()});
  const Ground floor{
      .kind = GroundKind::slope, .height_cm = planter.feet().floor_cm, .gradient = planter.feet().floor_gradient};
  return {.slide_cm_s = foot_slide_cm_s(tracks, feet.frames()).value_or(0),
          .floor_penetration_cm = floor_penetration_cm(tracks, floor)};
}

}  // namespace kinespace
