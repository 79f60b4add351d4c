#include "footskate/skate_measures.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "motion/kinematics.h"

namespace kinespace {

double foot_slide_cm_s(const FootTracks& tracks, const FootContacts& contacts) {
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
  return steps > 0 ? sum / static_cast<double>(steps) : 0;
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
  const JointPositions a = joint_positions(before);
  const JointPositions b = joint_positions(after);
  double largest = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) largest = std::max(largest, (a.values[i] - b.values[i]).norm());
  return largest;
}

double largest_acceleration_cm_s2(const Clip& clip) {
  const JointPositions p = joint_positions(clip);
  double largest = 0;
  for (int f = 1; f + 1 < clip.frames; ++f) {
    for (int j = 0; j < p.joints; ++j) {
      largest = std::max(largest, (p.at(f + 1, j) - 2 * p.at(f, j) + p.at(f - 1, j)).norm());
    }
  }
  return largest * clip.rate_hz * clip.rate_hz;
}

}  // namespace kinespace
