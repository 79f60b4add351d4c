#include "kinespace/footskate/keyframes.h"

#include <algorithm>
#include <cmath>

#include "kinespace/footskate/contacts.h"

namespace kinespace {
namespace {

constexpr double half_window_s = 0.083;
constexpr double height_weight = 3;

// The path at a time between frames.
Eigen::Vector3d at(const Path& path, double frame) {
  const int last = static_cast<int>(path.size()) - 1;
  const double f = std::clamp(frame, 0.0, static_cast<double>(last));
  const int i = std::min(static_cast<int>(f), std::max(0, last - 1));
  const int next = std::min(i + 1, last);
  return path[i] + (path[next] - path[i]) * (f - i);
}

}  // namespace

std::vector<double> levels_under(const FootTracks& tracks, const Ground& ground, int leg) {
  const int slot = tracks.has(2 * leg + 1) ? 2 * leg + 1 : 2 * leg;
  std::vector<double> out(tracks.frames);
  for (int f = 0; f < tracks.frames; ++f) out[f] = ground.at(tracks.at[slot][f]);
  if (ground.kind != GroundKind::uneven) return out;
  std::vector<double> before(tracks.frames, std::nan(""));
  for (const Rest& r : bearing_rests(tracks, ground)) {
    if (r.slot != slot) continue;
    std::fill(before.begin() + r.first_frame, before.begin() + r.last_frame + 1, r.place.y());
  }
  std::vector<double> after = before;
  for (int f = 1; f < tracks.frames; ++f) {
    if (std::isnan(before[f])) before[f] = before[f - 1];
  }
  for (int f = tracks.frames - 2; f >= 0; --f) {
    if (std::isnan(after[f])) after[f] = after[f + 1];
  }
  for (int f = 0; f < tracks.frames; ++f) {
    const double low = std::fmin(before[f], after[f]);
    if (!std::isnan(low)) out[f] = low;
  }
  return out;
}

std::vector<Keyframe> keyframes_of(const FootTracks& tracks, const Ground& ground, int leg) {
  std::vector<Keyframe> out;
  if (!tracks.has(2 * leg + 1)) return out;
  const double length = tracks.feet.leg_length_cm;
  const std::vector<double> level = levels_under(tracks, ground, leg);
  const double ankle_stand = standing_heights(tracks, ground)[2 * leg];
  const double mirror = leg == 0 ? 1 : -1;
  out.resize(tracks.frames);
  for (int f = 0; f < tracks.frames; ++f) {
    const Eigen::Vector3d across(std::cos(tracks.heading[f]), 0, -std::sin(tracks.heading[f]));
    const Eigen::Vector3d ahead(std::sin(tracks.heading[f]), 0, std::cos(tracks.heading[f]));
    std::size_t k = 0;
    for (int time = -2; time <= 2; ++time) {
      const double when = f + time * half_window_s / 2 * tracks.rate_hz;
      const Eigen::Vector3d root = at(tracks.root, when);
      for (int joint = 0; joint < 2; ++joint) {
        const Eigen::Vector3d p = at(tracks.at[2 * leg + joint], when);
        const double height = p.y() - level[f] - (joint == 0 ? ankle_stand : 0);
        out[f][k++] = static_cast<float>(mirror * across.dot(p - root) / length);
        out[f][k++] = static_cast<float>(ahead.dot(p - root) / length);
        out[f][k++] = static_cast<float>(height_weight * height / length);
      }
    }
  }
  return out;
}

float squared_distance(const Keyframe& a, const Keyframe& b) {
  float sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

}  // namespace kinespace
