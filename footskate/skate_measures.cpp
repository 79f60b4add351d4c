#include "kinespace/footskate/skate_measures.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "kinespace/footskate/contact_model.h"
#include "kinespace/motion/position_blocks.h"

namespace kinespace {
namespace {

constexpr double low_toe_cm = 2.5;
constexpr double low_ankle_cm = 4;
constexpr double slow_cm_s = 20;
constexpr double falling_cm_s = 20;

// How high each joint of a foot is over where it stands; infinite for one that is not there.
std::array<double, 4> heights_over_stand(const FootTracks& tracks, const FootLevel& level, int frame) {
  std::array<double, 4> out{};
  for (int slot = 0; slot < 4; ++slot) {
    out[slot] = std::numeric_limits<double>::infinity();
    if (!tracks.has(slot)) continue;
    const Eigen::Vector3d& p = tracks.at[slot][frame];
    out[slot] = p.y() - level.ground.at(p) - level.standing_cm[slot];
  }
  return out;
}

double ground_speed(const FootTracks& tracks, int slot, int frame) {
  const Eigen::Vector3d step = tracks.at[slot][frame + 1] - tracks.at[slot][frame];
  return std::hypot(step.x(), step.z()) * tracks.rate_hz;
}

struct Mean {
  double sum = 0;
  std::int64_t count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  [[nodiscard]] std::optional<double> value() const {
    return count == 0 ? std::nullopt : std::optional(sum / static_cast<double>(count));
  }
};

}  // namespace

FootLevel foot_level(const FootTracks& tracks) {
  FootLevel out{.ground = estimate_ground(tracks)};
  out.standing_cm = standing_heights(tracks, out.ground);
  return out;
}

FootMotion foot_motion(const FootTracks& tracks, const FootLevel& level) {
  return foot_motion(tracks, level, 0, tracks.frames - 1);
}

FootMotion foot_motion(const FootTracks& tracks, const FootLevel& level, int first, int last) {
  assert(first >= 0 && last < tracks.frames);
  FootMotion out;
  Mean slide;
  Mean lowest_speed;
  Mean hover;
  std::array<double, 4> now = heights_over_stand(tracks, level, first);
  for (int f = first; f <= last; ++f) {
    const auto lowest = std::ranges::min_element(now);
    for (int slot = 0; slot < 4; ++slot) {
      if (!tracks.has(slot)) continue;
      const Eigen::Vector3d& p = tracks.at[slot][f];
      out.penetration_cm = std::max(out.penetration_cm, level.ground.at(p) - p.y());
    }
    if (f == last) break;
    lowest_speed.add(ground_speed(tracks, static_cast<int>(lowest - now.begin()), f));
    const double rise = (tracks.root[f + 1] - tracks.root[f]).y() * tracks.rate_hz;
    if (rise > -falling_cm_s) hover.add(std::max(0.0, *lowest));
    const std::array<double, 4> next = heights_over_stand(tracks, level, f + 1);
    for (int slot = 0; slot < 4; ++slot) {
      const double low = slot % 2 == 0 && tracks.has(slot + 1) ? low_ankle_cm : low_toe_cm;
      if (!tracks.has(slot) || std::max(now[slot], next[slot]) > low) continue;
      const double speed = ground_speed(tracks, slot, f);
      if (speed < slow_cm_s) slide.add(speed);
    }
    now = next;
  }
  out.slide_cm_s = slide.value();
  out.lowest_speed_cm_s = lowest_speed.value();
  out.hover_cm = hover.value().value_or(0);
  return out;
}

std::optional<double> foot_slide_cm_s(const FootTracks& tracks, const FootContacts& contacts) {
  double sum = 0;
  std::int64_t steps = 0;
  for (const FootContact& c : contacts) {
    if (!tracks.has(c.slot)) continue;
    const Path& path = tracks.at[c.slot];
    for (int f = c.first_frame; f < c.last_frame; ++f, ++steps) {
      const Eigen::Vector3d step = path[f + 1] - path[f];
      sum += std::hypot(step.x(), step.z()) * tracks.rate_hz;
    }
  }
  if (steps == 0) return std::nullopt;
  return sum / static_cast<double>(steps);
}

double floor_penetration_cm(const FootTracks& tracks, const Ground& ground) {
  double deepest = 0;
  for (const Path& path : tracks.at) {
    for (const Eigen::Vector3d& p : path) deepest = std::max(deepest, ground.at(p) - p.y());
  }
  return deepest;
}

double mean_pose_change_cm(const Clip& before, const Clip& after) {
  assert(before.frames == after.frames && before.skeleton.joint_count() == after.skeleton.joint_count());
  const int root = before.skeleton.travel_root();
  std::vector<JointFrame> a;
  std::vector<JointFrame> b;
  double sum = 0;
  int joints = 0;
  for (int f = 0; f < before.frames; ++f) {
    world_frames(before, f, a);
    world_frames(after, f, b);
    joints = static_cast<int>(a.size()) - root;  // those above the travel root do not move
    for (std::size_t j = root; j < a.size(); ++j) {
      const Eigen::Vector3d in_a = a[root].rotation.conjugate() * (a[j].position - a[root].position);
      const Eigen::Vector3d in_b = b[root].rotation.conjugate() * (b[j].position - b[root].position);
      sum += (in_a - in_b).norm();
    }
  }
  return sum / (static_cast<double>(joints) * before.frames);
}

double largest_move_cm(const Clip& before, const Clip& after) {
  assert(before.frames == after.frames && before.skeleton.joint_count() == after.skeleton.joint_count());
  double largest = 0;
  JointPositions b;
  for_each_position_block(before, 0, [&](int first, const JointPositions& a) {
    positions_of_frames(after, first, a.frames, b);
    for (std::size_t i = 0; i < a.values.size(); ++i) largest = std::max(largest, (a.values[i] - b.values[i]).norm());
  });
  return largest;
}

double largest_acceleration_cm_s2(const Clip& clip) {
  double largest = 0;
  for_each_position_block(clip, 2, [&](int, const JointPositions& p) {
    for (int f = 1; f + 1 < p.frames; ++f) {
      for (int j = 0; j < p.joints; ++j) {
        largest = std::max(largest, (p.at(f + 1, j) - 2 * p.at(f, j) + p.at(f - 1, j)).norm());
      }
    }
  });
  return largest * clip.rate_hz * clip.rate_hz;
}

std::optional<SkateFigures> compare_skate(const Clip& a, const Clip& b) {
  const auto feet = find_feet(a);
  if (!feet || a.frames != b.frames) return std::nullopt;
  Feet other{.legs = {}, .root = b.skeleton.travel_root(), .leg_length_cm = feet->leg_length_cm};
  for (std::size_t leg = 0; leg < 2; ++leg) {
    const auto named = [&](int joint) { return joint < 0 ? -1 : b.skeleton.find(a.skeleton.joints[joint].name); };
    const Leg& from = feet->legs[leg];
    Leg& to = other.legs[leg];
    to = {named(from.hip), named(from.knee), named(from.ankle), named(from.toe)};
    if (to.hip < 0 || to.knee < 0 || to.ankle < 0) return std::nullopt;
  }
  const FootTracks reference = foot_tracks(a, *feet);
  const FootTracks judged = foot_tracks(b, other);
  const FootLevel level = foot_level(reference);
  const FootContacts contacts = ContactModel::standard().detect(reference, level.ground);
  return SkateFigures{.foot_slide_cm_s = foot_slide_cm_s(judged, contacts),
                      .floor_penetration_cm = floor_penetration_cm(judged, level.ground),
                      .of_a = foot_motion(reference, level),
                      .of_b = foot_motion(judged, level)};
}

}  // namespace kinespace
