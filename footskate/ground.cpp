#include "kinespace/footskate/ground.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include <Eigen/Dense>

namespace kinespace {
namespace {

constexpr double level_band = 0.03;  // leg lengths: heights of one level differ by less
constexpr double shortest_rest_s = 0.07;

struct Limits {
  double vertical;    // cm/s
  double horizontal;  // cm/s
};

// Whether the joint rests on the way from `f` to `f + 1`.
bool rests(const FootTracks& t, const Path& path, int f, const Limits& limits) {
  const Eigen::Vector3d v = (path[f + 1] - path[f]) * t.rate_hz;
  const Eigen::Vector3d root = (t.root[f + 1] - t.root[f]) * t.rate_hz;
  const double allowed = limits.horizontal + 0.3 * std::hypot(root.x(), root.z());
  return std::abs(v.y()) < limits.vertical && std::hypot(v.x(), v.z()) < allowed;
}

// The mean across the ground and the median height, which a foot about to leave does not lift.
Eigen::Vector3d place_of(const Path& path, const Rest& rest) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::vector<double> heights;
  for (int i = rest.first_frame; i <= rest.last_frame; ++i) {
    sum += path[i];
    heights.push_back(path[i].y());
  }
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::ranges::nth_element(heights, middle);
  const auto count = static_cast<double>(heights.size());
  return {sum.x() / count, *middle, sum.z() / count};
}

void rests_of(const FootTracks& t, int slot, std::vector<Rest>& out) {
  const Path& path = t.at[slot];
  const double length = t.feet.leg_length_cm;
  const Limits limits{.vertical = 0.15 * length, .horizontal = 0.18 * length};
  for (int f = 0; f + 1 < t.frames; ++f) {
    if (!rests(t, path, f, limits)) continue;
    Rest rest{.slot = slot, .first_frame = f};
    while (f + 1 < t.frames && rests(t, path, f, limits)) ++f;
    rest.last_frame = f;
    if (rest.last_frame - rest.first_frame < shortest_rest_s * t.rate_hz - 1e-9) continue;
    rest.place = place_of(path, rest);
    out.push_back(rest);
  }
}

double weight(const Rest& rest) {
  return rest.last_frame - rest.first_frame + 1;
}

double total(const std::vector<Rest>& rests) {
  double sum = 0;
  for (const Rest& r : rests) sum += weight(r);
  return sum;
}

// The weighted median of rests in order of height.
double middle_height(std::span<const Rest> rests, double sum) {
  double below = 0;
  for (const Rest& r : rests) {
    below += weight(r);
    if (below >= sum / 2) return r.place.y();
  }
  return rests.back().place.y();
}

// The heaviest group of rests whose heights (less those of the plane) lie within a band.
struct Level {
  double height = 0;
  double share = 0;  // of the weight of all
  double above = 0;  // share that lies above the band
};

Level heaviest_level(std::vector<Rest> rests, double band) {
  std::ranges::sort(rests, {}, [](const Rest& r) { return r.place.y(); });
  const double all = total(rests);
  double heaviest = 0;
  std::span<const Rest> group;
  double sum = 0;  // of rests i to j - 1; weights are whole numbers, so nothing is lost in taking them off again
  std::size_t j = 0;
  for (std::size_t i = 0; i < rests.size(); ++i) {
    for (; j < rests.size() && rests[j].place.y() <= rests[i].place.y() + 2 * band; ++j) sum += weight(rests[j]);
    if (sum > heaviest) {
      heaviest = sum;
      group = std::span(rests).subspan(i, j - i);
    }
    sum -= weight(rests[i]);
  }
  if (group.empty()) return {};
  Level best{.height = middle_height(group, heaviest), .share = heaviest / all};
  for (const Rest* r = group.data() + group.size(); r != rests.data() + rests.size(); ++r)
    best.above += weight(*r) / all;
  return best;
}

// height = x0 + x1 X + x2 Z by weighted least squares, those far off left out in a second and third pass.
Ground fit_plane(const std::vector<Rest>& rests, double band, double& share) {
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();
  double tolerance = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 4; ++pass) {
    Eigen::Matrix3d a = 1e-6 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const Rest& r : rests) {
      const Eigen::Vector3d row(1, r.place.x(), r.place.z());
      if (std::abs(r.place.y() - row.dot(plane)) > tolerance) continue;
      a += weight(r) * row * row.transpose();
      b += weight(r) * r.place.y() * row;
    }
    plane = a.ldlt().solve(b);
    tolerance = std::max(band, pass == 0 ? 3 * band : 1.5 * band);
  }
  share = 0;
  const double all = total(rests);
  for (const Rest& r : rests) {
    const double off = r.place.y() - plane.dot(Eigen::Vector3d(1, r.place.x(), r.place.z()));
    if (std::abs(off) <= band) share += weight(r) / all;
  }
  return {.kind = GroundKind::slope, .height_cm = plane.x(), .gradient = {plane.y(), plane.z()}};
}

double spread(const std::vector<Rest>& rests) {
  Eigen::Vector3d low = rests.front().place;
  Eigen::Vector3d high = low;
  for (const Rest& r : rests) {
    low = low.cwiseMin(r.place);
    high = high.cwiseMax(r.place);
  }
  return std::hypot(high.x() - low.x(), high.z() - low.z());
}

// Whether a plane through so few resting places says anything: one that rises goes through any three of them. Asked are
// supports of both feet at three places or more along the rise, a step apart in place and one after another in time,
// and a body above the plane.
bool believable(const Ground& slope, const std::vector<Rest>& rests, const FootTracks& t, double band) {
  const double leg = t.feet.leg_length_cm;
  const double step = 0.4 * leg;
  const Eigen::Vector2d along = slope.gradient.normalized();
  std::vector<const Rest*> by_time;
  for (const Rest& r : rests) {
    if (std::abs(r.place.y() - slope.at(r.place)) <= band) by_time.push_back(&r);
  }
  std::ranges::sort(by_time, {}, [](const Rest* r) { return std::pair(r->first_frame, r->slot); });
  std::vector<double> places;  // along the rise
  std::array<bool, 2> feet{};
  for (const Rest* r : by_time) {
    const double at = along.dot(Eigen::Vector2d(r->place.x(), r->place.z()));
    const bool apart = std::ranges::all_of(places, [&](double other) { return std::abs(at - other) >= step; });
    if (apart) places.push_back(at);
    feet[static_cast<std::size_t>(r->slot / 2)] = true;
  }
  if (places.size() < 3 || !feet[0] || !feet[1]) return false;
  const auto held =
      std::ranges::count_if(t.root, [&](const Eigen::Vector3d& p) { return p.y() > slope.at(p) + 0.3 * leg; });
  return static_cast<double>(held) >= 0.95 * t.frames;
}

Ground lowest_point(const FootTracks& t) {
  double low = std::numeric_limits<double>::infinity();
  for (const Path& path : t.at) {
    for (const auto& p : path) low = std::min(low, p.y());
  }
  return {.height_cm = low};
}

double lowest_level(std::vector<Rest> rests, double band) {
  std::ranges::sort(rests, {}, [](const Rest& r) { return r.place.y(); });
  const double enough = 0.1 * total(rests);
  double sum = 0;
  for (const Rest& r : rests) {
    sum += weight(r);
    if (sum >= enough) {
      std::erase_if(rests, [&](const Rest& other) { return other.place.y() > r.place.y() + band; });
      break;
    }
  }
  return heaviest_level(rests, band).height;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

// The height of the lowest resting joint of a leg at each frame; infinite: none rests.
std::vector<double> resting_heights(const std::vector<Rest>& rests, int leg, int frames) {
  std::vector<double> out(frames, std::numeric_limits<double>::infinity());
  for (const Rest& r : rests) {
    if (r.slot / 2 != leg) continue;
    for (int f = r.first_frame; f <= r.last_frame; ++f) out[f] = std::min(out[f], r.place.y());
  }
  return out;
}

// Alone at some time, or never above the other foot by more than `band`.
bool bears(const Rest& rest, const std::vector<double>& own, const std::vector<double>& other, double band) {
  bool alone = false;
  bool above = false;
  for (int f = rest.first_frame; f <= rest.last_frame; ++f) {
    alone = alone || std::isinf(other[f]);
    above = above || own[f] > other[f] + band;
  }
  return alone || !above;
}

}  // namespace

std::string_view to_string(GroundKind kind) {
  switch (kind) {
    case GroundKind::flat:
      return "flat";
    case GroundKind::slope:
      return "slope";
    case GroundKind::uneven:
      break;
  }
  return "uneven";
}

std::vector<Rest> find_rests(const FootTracks& tracks) {
  std::vector<Rest> out;
  for (int slot = 0; slot < 4; ++slot) {
    if (tracks.has(slot)) rests_of(tracks, slot, out);
  }
  return out;
}

std::array<double, 4> standing_heights(const FootTracks& tracks, const Ground& ground) {
  std::array<double, 4> out{};
  std::array<std::vector<double>, 2> heights;
  const double band = 0.05 * tracks.feet.leg_length_cm;
  for (const Rest& r : find_rests(tracks)) {
    if (r.slot % 2 != 0 || !tracks.has(r.slot + 1)) continue;
    for (int f = r.first_frame; f <= r.last_frame; ++f) {
      const Eigen::Vector3d& toe = tracks.at[r.slot + 1][f];
      if (ground.kind != GroundKind::uneven && std::abs(toe.y() - ground.at(toe)) > band) continue;
      const double level = ground.kind == GroundKind::uneven ? toe.y() : ground.at(tracks.at[r.slot][f]);
      heights[r.slot / 2].push_back(tracks.at[r.slot][f].y() - level);
    }
  }
  for (std::size_t leg = 0; leg < 2; ++leg) out[2 * leg] = median(heights[heights[leg].empty() ? 1 - leg : leg]);
  return out;
}

std::vector<Rest> bearing_rests(const FootTracks& tracks, const Ground& ground) {
  const double band = 0.05 * tracks.feet.leg_length_cm;
  const auto stand = standing_heights(tracks, ground);
  std::vector<Rest> rests = find_rests(tracks);
  const std::array<std::vector<double>, 2> heights = {resting_heights(rests, 0, tracks.frames),
                                                      resting_heights(rests, 1, tracks.frames)};
  std::erase_if(rests, [&](const Rest& r) {
    if (ground.kind == GroundKind::uneven) return !bears(r, heights[r.slot / 2], heights[1 - r.slot / 2], band);
    return std::abs(r.place.y() - ground.at(r.place) - stand[r.slot]) > band;
  });
  return rests;
}

Ground estimate_ground(const FootTracks& tracks) {
  std::vector<Rest> rests = find_rests(tracks);
  std::erase_if(rests, [&](const Rest& r) { return r.slot % 2 == 0 && tracks.has(r.slot + 1); });
  if (rests.empty()) return lowest_point(tracks);
  const double band = level_band * tracks.feet.leg_length_cm;
  const Level level = heaviest_level(rests, band);
  if (level.share >= 0.9 || (level.share >= 0.85 && level.share + level.above > 0.99)) {
    return {.height_cm = level.height};
  }
  if (spread(rests) > 0.5 * tracks.feet.leg_length_cm) {
    double share = 0;
    const Ground slope = fit_plane(rests, band, share);
    if (share >= 0.9 && slope.gradient.norm() <= 0.7 && believable(slope, rests, tracks, band)) return slope;
  }
  return {.kind = GroundKind::uneven, .height_cm = lowest_level(rests, band)};
}

}  // namespace kinespace
