#include "kinespace/footskate/detail/leg_goals.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "kinespace/footskate/detail/leg_swing.h"

namespace kinespace {
namespace {

using Eigen::Vector3d;

// How far the foot would be under the floor at each frame between plants, cm.
std::vector<double> depths(const FootTracks& t, const FloorUnder& floor, int leg, const FootTask& task,
                           const LegGoals::Side& goals) {
  std::vector<double> out(t.frames, 0.0);
  for (int f = 0; f < t.frames; ++f) {
    if (task.planted[f] != 0) continue;
    const Vector3d ankle = goals.ankle[f];
    out[f] = std::max(0.0, floor.at(ankle, f) - ankle.y());
    if (!t.has(2 * leg + 1)) continue;
    Vector3d way = t.at[2 * leg + 1][f] - t.at[2 * leg][f];
    const double angle = goals.foot_turn[f].norm();
    if (angle > 0) way = Eigen::AngleAxisd(angle, goals.foot_turn[f] / angle) * way;
    const Vector3d toe = ankle + way;
    out[f] = std::max(out[f], floor.at(toe, f) - toe.y());
  }
  return out;
}

// Lifts the ankle's goals where ankle or toe would be under the floor, and smoothly around there: each depth as a bump
// of at most 0.12 s to both sides, less where a plant is nearer.
void keep_above(const FootTracks& t, const FloorUnder& floor, int leg, const FootTask& task, LegGoals::Side& goals) {
  const std::vector<double> depth = depths(t, floor, leg, task, goals);
  const int widest = std::max(1, static_cast<int>(0.12 * t.rate_hz));
  std::vector<double> lift(t.frames, 0.0);
  for (int f = 0; f < t.frames; ++f) {
    if (depth[f] <= 0) continue;
    int before = 0;
    int after = 0;
    while (before < widest && f - before - 1 >= 0 && task.planted[f - before - 1] == 0) ++before;
    while (after < widest && f + after + 1 < t.frames && task.planted[f + after + 1] == 0) ++after;
    for (int g = f - before; g <= f + after; ++g) {
      const double x = static_cast<double>(g - f) / (g < f ? before + 1 : after + 1);
      const double shape = 1 - x * x;
      lift[g] = std::max(lift[g], depth[f] * shape * shape * shape);
    }
  }
  for (int f = 0; f < t.frames; ++f) goals.ankle[f].y() += lift[f];
}

}  // namespace

LegGoals leg_goals(const FootTracks& tracks, const std::array<FloorUnder, 2>& floors,
                   const std::array<FootTask, 2>& tasks, std::vector<Vector3d> shift) {
  LegGoals out{.root_shift = std::move(shift), .sides = {}};
  for (int leg = 0; leg < 2; ++leg) {
    LegGoals::Side& side = out.sides[leg];
    side.ankle = ankle_goals(tracks, leg, tasks[leg], out.root_shift);
    side.foot_turn = tasks[leg].turn;
    for (std::size_t f = 0; f < tasks[leg].lift.size(); ++f) side.ankle[f].y() += tasks[leg].lift[f];
    keep_above(tracks, floors[leg], leg, tasks[leg], side);
  }
  return out;
}

}  // namespace kinespace
