#include "kinespace/footskate/plants.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

namespace kinespace {
namespace {

using Eigen::Vector3d;

constexpr double ground_band = 0.08;  // leg lengths: as near as contacts are to the ground

int overlap(const FootContact& a, const FootContact& b) {
  return std::min(a.last_frame, b.last_frame) - std::max(a.first_frame, b.first_frame) + 1;
}

int length(const FootContact& c) {
  return c.last_frame - c.first_frame + 1;
}

// The frames but for a tenth, and at least one, at both ends, where a joint may be coming or leaving.
std::pair<int, int> core(int first, int last) {
  const int off = last - first >= 3 ? std::max(1, (last - first) / 10) : 0;
  return {first + off, last - off};
}

double median_height(const Path& path, const FootContact& c) {
  std::vector<double> heights;
  for (int f = c.first_frame; f <= c.last_frame; ++f) heights.push_back(path[f].y());
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::ranges::nth_element(heights, middle);
  return *middle;
}

class Placer {
 public:
  Placer(const FootTracks& tracks, const Ground& ground, const FootContacts& contacts) : t_(tracks), ground_(ground) {
    for (const FootContact& c : contacts) plants_.push_back({.contact = c});
    placed_.assign(plants_.size(), 0);
    for (std::size_t i = 0; i < plants_.size(); ++i) {
      Slot& slot = slots_[plants_[i].contact.slot];
      slot.in_time.push_back(i);
      slot.longest = std::max(slot.longest, length(plants_[i].contact));
    }
    for (Slot& slot : slots_) {
      std::ranges::sort(slot.in_time, {}, [&](std::size_t i) { return plants_[i].contact.first_frame; });
    }
  }

  std::vector<Plant> place() {
    std::vector<std::size_t> order(plants_.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::ranges::stable_sort(
        order, [&](std::size_t a, std::size_t b) { return length(plants_[a].contact) > length(plants_[b].contact); });
    for (const std::size_t i : order) {
      if (placed_[i] == 0) place_stance(i);
    }
    return std::move(plants_);
  }

 private:
  // The longest contact of a stance by itself, then those that overlap with what is placed, from it.
  void place_stance(std::size_t first) {
    plants_[first].place = own_place(plants_[first].contact);
    placed_[first] = 1;
    std::vector<std::size_t> stance = {first};
    for (std::size_t next = 0; next < stance.size(); ++next) {
      const std::size_t from = stance[next];
      for (const std::size_t i : overlapping(plants_[from].contact)) {
        if (placed_[i] != 0) continue;
        plants_[i].place = plants_[from].place + mean_way(plants_[from].contact, plants_[i].contact);
        placed_[i] = 1;
        stance.push_back(i);
      }
    }
    settle(stance);
  }

  // The plants of the foot's other joint that overlap with `a`, in order.
  [[nodiscard]] std::vector<std::size_t> overlapping(const FootContact& a) const {
    const Slot& slot = slots_[a.slot ^ 1];
    const auto first = std::ranges::lower_bound(slot.in_time, a.first_frame - slot.longest, {},
                                                [&](std::size_t i) { return plants_[i].contact.first_frame; });
    std::vector<std::size_t> out;
    for (auto at = first; at != slot.in_time.end() && plants_[*at].contact.first_frame <= a.last_frame; ++at) {
      if (overlap(a, plants_[*at].contact) >= 1) out.push_back(*at);
    }
    std::ranges::sort(out);
    return out;
  }

  // Sets a stance on the ground, by the longest stand of its lowest joint.
  void settle(const std::vector<std::size_t>& stance) {
    const auto lowest = [&](std::size_t i) {
      const int slot = plants_[i].contact.slot;
      return slot % 2 == 1 || !t_.has(slot + 1);
    };
    std::size_t base = plants_.size();
    for (const std::size_t i : stance) {
      const bool longer = base == plants_.size() || length(plants_[i].contact) > length(plants_[base].contact);
      if (lowest(i) && longer) base = i;
    }
    if (base == plants_.size()) return;
    const double above = plants_[base].place.y() - ground_.at(plants_[base].place);
    if (ground_.kind == GroundKind::uneven || std::abs(above) > ground_band * t_.feet.leg_length_cm) return;
    for (const std::size_t i : stance) plants_[i].place.y() -= above;
    for (const std::size_t i : stance) {
      if (i != base && lowest(i)) level(i, stance);
    }
  }

  // Sets another stand of the lowest joint on the ground, at the foot's length from the joint it stands with.
  void level(std::size_t i, const std::vector<std::size_t>& stance) {
    const auto other = std::ranges::find_if(stance, [&](std::size_t j) {
      return plants_[j].contact.slot != plants_[i].contact.slot && overlap(plants_[i].contact, plants_[j].contact) > 0;
    });
    if (other == stance.end()) return;
    const Vector3d way = plants_[i].place - plants_[*other].place;
    const double drop = ground_.at(plants_[i].place) - plants_[*other].place.y();
    const Vector3d along(way.x(), 0, way.z());
    if (std::abs(drop) >= way.norm() || along.norm() < 1e-6) return;
    const double reach = std::sqrt(way.squaredNorm() - drop * drop);
    plants_[i].place = plants_[*other].place + along.normalized() * reach + drop * Vector3d::UnitY();
  }

  [[nodiscard]] Vector3d own_place(const FootContact& c) const {
    const Path& path = t_.at[c.slot];
    const auto [first, last] = core(c.first_frame, c.last_frame);
    Vector3d sum = Vector3d::Zero();
    for (int f = first; f <= last; ++f) sum += path[f];
    Vector3d place = sum / (last - first + 1);
    place.y() = median_height(path, c);
    return place;
  }

  // From the joint of `a` to that of `b`: as long as in the first common frame, in the mean direction of all of them.
  [[nodiscard]] Vector3d mean_way(const FootContact& a, const FootContact& b) const {
    const auto [first, last] = core(std::max(a.first_frame, b.first_frame), std::min(a.last_frame, b.last_frame));
    Vector3d sum = Vector3d::Zero();
    for (int f = first; f <= last; ++f) sum += t_.at[b.slot][f] - t_.at[a.slot][f];
    return sum.normalized() * (t_.at[b.slot][first] - t_.at[a.slot][first]).norm();
  }

  const FootTracks& t_;
  // The plants of one joint.
  struct Slot {
    std::vector<std::size_t> in_time;
    int longest = 0;  // frames
  };

  const Ground& ground_;
  std::vector<Plant> plants_;
  std::vector<char> placed_;
  std::array<Slot, 4> slots_;
};

Eigen::Quaterniond rotation(const Vector3d& turn) {
  const double angle = turn.norm();
  return angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) : Eigen::Quaterniond::Identity();
}

Vector3d turned(const Vector3d& turn, const Vector3d& v) {
  return rotation(turn) * v;
}

// The turn with which the far joint, at `way` from the near one at `base`, is not under the floor.
Vector3d turn_above(const Vector3d& base, const Vector3d& way, const Vector3d& turn, double floor) {
  const Vector3d now = turned(turn, way);
  const double length = now.norm();
  const double rise = floor - base.y();
  const Vector3d level(now.x(), 0, now.z());
  if (now.y() >= rise || std::abs(rise) >= length || level.norm() < 1e-6 * length) return turn;
  const Vector3d raised = level.normalized() * std::sqrt(length * length - rise * rise) + rise * Vector3d::UnitY();
  const Eigen::AngleAxisd whole(Eigen::Quaterniond::FromTwoVectors(now, raised) * rotation(turn));
  return whole.angle() * whole.axis();
}

Vector3d turn_between(const Vector3d& from, const Vector3d& to) {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond::FromTwoVectors(from, to));
  return turn.angle() * turn.axis();
}

// The place at each frame of a joint that stands, else nullptr.
std::vector<const Vector3d*> places(const std::vector<Plant>& plants, int slot, int frames) {
  std::vector<const Vector3d*> out(frames, nullptr);
  for (const Plant& p : plants) {
    if (p.contact.slot != slot) continue;
    std::fill(out.begin() + p.contact.first_frame, out.begin() + p.contact.last_frame + 1, &p.place);
  }
  return out;
}

// The mean speed of the values over at most `span` steps from frame `from` on in the direction `step`, per frame.
Vector3d speed_at(const std::vector<Vector3d>& values, const std::vector<char>& known, int from, int step, int span) {
  int far = from;
  for (int i = 0; i < span; ++i) {
    const int next = far + step;
    if (next < 0 || next >= static_cast<int>(known.size()) || known[next] == 0) break;
    far = next;
  }
  return far == from ? Vector3d::Zero() : Vector3d((values[from] - values[far]) / (from - far));
}

double smootherstep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

// At s = 0 of value 0 and slope 1, flat to second order at s >= 1.
double run_out(double s) {
  return s >= 1 ? 0 : s * (1 + s * s * (-6 + s * (8 - 3 * s)));
}

// Where there is no level, the lower of those before and after; without any, `otherwise`.
std::vector<double> between_stands(const std::vector<double>& stand, double otherwise) {
  std::vector<double> before = stand;
  std::vector<double> after = stand;
  const std::size_t frames = stand.size();
  for (std::size_t f = 1; f < frames; ++f) {
    if (std::isnan(before[f])) before[f] = before[f - 1];
  }
  for (std::size_t f = frames - 1; f-- > 0;) {
    if (std::isnan(after[f])) after[f] = after[f + 1];
  }
  for (std::size_t f = 0; f < frames; ++f) {
    before[f] = std::fmin(before[f], after[f]);
    if (std::isnan(before[f])) before[f] = otherwise;
  }
  return before;
}

struct GapEnd {
  bool known = false;
  int frame = 0;
  Vector3d value = Vector3d::Zero();
  Vector3d speed = Vector3d::Zero();  // per frame
};

Vector3d joined(const GapEnd& a, const GapEnd& b, int f, double rate_hz) {
  const double ease = 0.5 * rate_hz;    // frames to ease to zero at the ends of the clip
  const double coast = 0.15 * rate_hz;  // frames in which a speed runs out
  const double gap = a.known && b.known ? b.frame - a.frame : ease;
  const double run = std::min(gap, coast);
  Vector3d out = Vector3d::Zero();
  if (a.known) {
    const double s = (f - a.frame) / run;
    out += (1 - smootherstep((f - a.frame) / gap)) * a.value + run * run_out(s) * a.speed;
  }
  if (b.known) {
    const double s = (b.frame - f) / run;
    out += (1 - smootherstep((b.frame - f) / gap)) * b.value - run * run_out(s) * b.speed;
  }
  return out;
}

}  // namespace

std::vector<Plant> place_plants(const FootTracks& tracks, const Ground& ground, const FootContacts& contacts) {
  return Placer(tracks, ground, contacts).place();
}

namespace {

// A stand in which the foot has to move by less than half a millimetre stays as it is: near full length of the leg even
// that would move the knee. But a foot under the ground is lifted.
void leave_still(const FootTracks& tracks, int leg, FootTask& task) {
  constexpr double still_cm = 0.05;
  const double length = tracks.has(2 * leg + 1) ? (tracks.at[2 * leg + 1][0] - tracks.at[2 * leg][0]).norm() : 0;
  for (int f = 0; f < tracks.frames; ++f) {
    if (task.planted[f] == 0) continue;
    const int first = f;
    double most = 0;
    for (; f < tracks.frames && task.planted[f] != 0; ++f) {
      most = std::max({most, task.displacement[f].norm(), length * task.turn[f].norm(), 10 * task.displacement[f].y()});
    }
    for (int i = first; most <= still_cm && i < f; ++i) task.displacement[i] = task.turn[i] = Vector3d::Zero();
  }
}

}  // namespace

FloorUnder::FloorUnder(const FootTracks& tracks, const Ground& ground, const std::vector<Plant>& plants, int leg)
    : ground_(ground) {
  if (ground.kind != GroundKind::uneven) return;
  std::vector<double> stand(tracks.frames, std::nan(""));
  const double ankle_height = standing_heights(tracks, ground)[2 * leg];
  for (const Plant& p : plants) {
    if (p.contact.slot / 2 != leg) continue;
    const double level = p.place.y() - (p.contact.slot % 2 == 0 ? ankle_height : 0);
    for (int f = p.contact.first_frame; f <= p.contact.last_frame; ++f) stand[f] = std::fmin(stand[f], level);
  }
  level_ = between_stands(stand, ground.height_cm);
  lower_to_foot(tracks, leg, stand);
}

// Between stands: where the captured foot goes far below both, the ground is lower than they are.
void FloorUnder::lower_to_foot(const FootTracks& tracks, int leg, const std::vector<double>& stand) {
  const double far = ground_band * tracks.feet.leg_length_cm;
  const Path& lowest = tracks.at[tracks.has(2 * leg + 1) ? 2 * leg + 1 : 2 * leg];
  for (int f = 0; f < tracks.frames; ++f) {
    if (!std::isnan(stand[f])) continue;
    int last = f;
    while (last + 1 < tracks.frames && std::isnan(stand[last + 1])) ++last;
    double depth = 0;
    for (int i = f; i <= last; ++i) depth = std::max(depth, level_[i] - lowest[i].y());
    for (int i = f; depth > far && i <= last; ++i) level_[i] -= depth;
    f = last;
  }
}

FootTask foot_task(const FootTracks& tracks, int leg, const std::vector<Plant>& plants, const FloorUnder& floor) {
  const std::size_t frames = tracks.frames;
  FootTask out{.planted = std::vector<char>(frames, 0),
               .flat = std::vector<char>(frames, 0),
               .turn = std::vector<Vector3d>(frames, Vector3d::Zero()),
               .displacement = std::vector<Vector3d>(frames, Vector3d::Zero())};
  const auto ankle = places(plants, 2 * leg, tracks.frames);
  const auto toe = places(plants, 2 * leg + 1, tracks.frames);
  const Path& ankle_path = tracks.at[2 * leg];
  const Path& toe_path = tracks.at[2 * leg + 1];
  for (std::size_t f = 0; f < frames; ++f) {
    out.planted[f] = ankle[f] != nullptr || toe[f] != nullptr ? 1 : 0;
    out.flat[f] = ankle[f] != nullptr && toe[f] != nullptr ? 1 : 0;
    if (out.flat[f] != 0) out.turn[f] = turn_between(toe_path[f] - ankle_path[f], *toe[f] - *ankle[f]);
  }
  join_between(out.flat, tracks.rate_hz, out.turn);
  for (std::size_t f = 0; f < frames; ++f) {
    if (out.planted[f] == 0) continue;
    const bool has_toe = !toe_path.empty();
    if (ankle[f] != nullptr) {
      out.displacement[f] = *ankle[f] - ankle_path[f];
      if (toe[f] != nullptr || !has_toe) continue;
      const Vector3d way = toe_path[f] - ankle_path[f];
      const double level = floor.at(*ankle[f] + way, static_cast<int>(f));
      out.turn[f] = turn_above(*ankle[f], way, out.turn[f], level);
    } else {
      const Vector3d way = ankle_path[f] - toe_path[f];
      const double level = floor.at(*toe[f] + way, static_cast<int>(f));
      out.turn[f] = turn_above(*toe[f], way, out.turn[f], level);
      out.displacement[f] = *toe[f] + turned(out.turn[f], way) - ankle_path[f];
    }
  }
  leave_still(tracks, leg, out);
  join_between(out.planted, tracks.rate_hz, out.turn);
  return out;
}

void join_between(const std::vector<char>& known, double rate_hz, std::vector<Vector3d>& values) {
  const int frames = static_cast<int>(known.size());
  const int span = std::max(1, static_cast<int>(std::lround(0.06 * rate_hz)));
  for (int f = 0; f < frames; ++f) {
    if (known[f] != 0) continue;
    int last = f;
    while (last + 1 < frames && known[last + 1] == 0) ++last;
    GapEnd a{.known = f > 0, .frame = f - 1};
    GapEnd b{.known = last + 1 < frames, .frame = last + 1};
    if (a.known) a = {true, a.frame, values[a.frame], speed_at(values, known, a.frame, -1, span)};
    if (b.known) b = {true, b.frame, values[b.frame], speed_at(values, known, b.frame, 1, span)};
    for (int i = f; i <= last; ++i) values[i] = joined(a, b, i, rate_hz);
    f = last;
  }
}

}  // namespace kinespace
