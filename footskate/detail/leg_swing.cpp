#include "kinespace/footskate/detail/leg_swing.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "kinespace/footskate/two_bone_ik.h"

namespace kinespace {
namespace {

using Eigen::Vector3d;

struct Bones {
  double thigh;
  double shin;

  // The angle by which the knee is bent, radians; 0: straight.
  [[nodiscard]] double bend(double reach) const {
    const double cosine = (reach * reach - thigh * thigh - shin * shin) / (2 * thigh * shin);
    return std::acos(std::clamp(cosine, -1.0, 1.0));
  }
  [[nodiscard]] double reach(double bend) const {
    return std::sqrt(std::max(0.0, thigh * thigh + shin * shin + 2 * thigh * shin * std::cos(bend)));
  }
};

Bones bones_at(const FootTracks& t, int leg, int f) {
  return {(t.knee[leg][f] - t.hip[leg][f]).norm(), (t.at[2 * leg][f] - t.knee[leg][f]).norm()};
}

// A bend near zero, softly kept from it: what is less than 0.15, or than it was where that is less, nears 0.3 of that.
double soft_bend(double bend, double was) {
  const double soft = std::min(was, 0.15);
  if (bend >= soft || soft <= 0) return std::max(bend, soft);
  const double least = 0.3 * soft;
  return least + (soft - least) * std::exp((bend - soft) / (soft - least));
}

}  // namespace

std::vector<Vector3d> ankle_goals(const FootTracks& tracks, int leg, const FootTask& task,
                                  const std::vector<Vector3d>& shift) {
  const Path& ankle = tracks.at[2 * leg];
  const Path& hip = tracks.hip[leg];
  std::vector<Vector3d> turn(tracks.frames, Vector3d::Zero());
  std::vector<Vector3d> bend(tracks.frames, Vector3d::Zero());  // x only
  for (int f = 0; f < tracks.frames; ++f) {
    if (task.planted[f] == 0) continue;
    const Vector3d before = ankle[f] - hip[f];
    const Vector3d after = before + task.displacement[f] - shift[f];
    const Eigen::AngleAxisd angle(Eigen::Quaterniond::FromTwoVectors(before, after));
    const Bones bones = bones_at(tracks, leg, f);
    const double reach = soft_reach(after.norm(), before.norm(), bones.thigh + bones.shin);
    turn[f] = angle.angle() * angle.axis();
    bend[f].x() = bones.bend(reach) - bones.bend(before.norm());
  }
  join_between(task.planted, tracks.rate_hz, turn);
  join_between(task.planted, tracks.rate_hz, bend);
  std::vector<Vector3d> out;
  for (int f = 0; f < tracks.frames; ++f) {
    if (task.planted[f] != 0) {
      out.push_back(ankle[f] + task.displacement[f]);
      continue;
    }
    const Bones bones = bones_at(tracks, leg, f);
    const Vector3d before = ankle[f] - hip[f];
    const double was = bones.bend(before.norm());
    const double reach = bend[f].x() == 0 ? before.norm() : bones.reach(soft_bend(was + bend[f].x(), was));
    const double angle = turn[f].norm();
    const Vector3d way = angle > 0 ? Vector3d(Eigen::AngleAxisd(angle, turn[f] / angle) * before) : before;
    out.push_back(hip[f] + shift[f] + way.normalized() * reach);
  }
  return out;
}

}  // namespace kinespace
