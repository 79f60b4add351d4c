#include "kinespace/footskate/feet.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

constexpr double unequal = 0.1;  // mirrored bones differ by less than this share

// Lower case, without what stands before a colon and without separators.
std::string plain(std::string_view name) {
  name = name.substr(name.rfind(':') + 1);  // npos + 1 is 0
  std::string out;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) out += static_cast<char>(std::tolower(c));
  }
  return out;
}

bool has(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

// 0 left, 1 right, -1: the name does not say.
int side_of(const std::string& name) {
  const std::string p = plain(name);
  if (has(p, "left")) return 0;
  if (has(p, "right")) return 1;
  if (p.empty()) return -1;
  const std::size_t at = name.find_last_of("_.- ");
  if (at != std::string::npos && at + 2 == name.size()) {
    const char last = p.back();
    if (last == 'l' || last == 'r') return last == 'l' ? 0 : 1;
  }
  if (p.front() == 'l' || p.front() == 'r') return p.front() == 'l' ? 0 : 1;
  return -1;
}

bool names_ankle(const std::string& name) {
  const std::string p = plain(name);
  return (has(p, "foot") || has(p, "ankle")) && !has(p, "toe") && !has(p, "ball") && !has(p, "end");
}

double bone(const Skeleton& s, int joint) {
  return s.joints[joint].offset.norm();
}

// From a joint up to and without the travel root.
std::vector<int> above(const Skeleton& s, int joint, int root) {
  std::vector<int> out;
  for (int j = joint; j >= 0 && j != root; j = s.joints[j].parent) out.push_back(j);
  return out;
}

double along(const Skeleton& s, const std::vector<int>& chain, std::size_t from, std::size_t to) {
  double sum = 0;
  for (std::size_t i = from; i < to; ++i) sum += bone(s, chain[i]);
  return sum;
}

// At most 50 frames of the clip, and the mean height of every joint in them: what the shape is judged by.
struct Stance {
  std::vector<double> height;
  JointPositions positions;  // the frames looked at
};

Stance stance_of(const Clip& clip) {
  constexpr int wanted = 50;
  Stance out{.height = std::vector<double>(clip.skeleton.joints.size(), 0.0), .positions = {}};
  out.positions.joints = clip.skeleton.joint_count();
  std::vector<JointFrame> frame;
  for (int i = 0; i < std::min(wanted, clip.frames); ++i) {
    world_frames(clip, static_cast<int>(static_cast<std::int64_t>(i) * clip.frames / wanted) % clip.frames, frame);
    for (std::size_t j = 0; j < frame.size(); ++j) {
      out.height[j] += frame[j].position.y();
      out.positions.values.push_back(frame[j].position);
    }
    ++out.positions.frames;
  }
  for (double& h : out.height) h /= out.positions.frames;
  return out;
}

// Whether the bones between two joints of a chain (twist joints between them) lie on a line.
bool straight(const Stance& stance, const std::vector<int>& chain, std::size_t from, std::size_t to, double length) {
  if (to - from < 2) return true;
  double sum = 0;
  for (int f = 0; f < stance.positions.frames; ++f) {
    sum += (stance.positions.at(f, chain[from]) - stance.positions.at(f, chain[to])).norm();
  }
  return sum >= 0.98 * length * stance.positions.frames;
}

// Hip and knee above an ankle: the shorter of thigh and shin as long as can be. No knee: the leg's hip is -1.
Leg leg_above(const Skeleton& s, const Stance& stance, int ankle, int root) {
  const std::vector<int> chain = above(s, ankle, root);
  Leg out{.ankle = ankle};
  double best = 0;
  for (std::size_t hip = 2; hip < chain.size(); ++hip) {
    for (std::size_t knee = 1; knee < hip; ++knee) {
      const double shin = along(s, chain, 0, knee);
      const double thigh = along(s, chain, knee, hip);
      if (std::min(shin, thigh) <= best * 1.02) continue;  // of equals the lowest
      if (!straight(stance, chain, 0, knee, shin) || !straight(stance, chain, knee, hip, thigh)) continue;
      best = std::min(shin, thigh);
      out.knee = chain[knee];
      out.hip = chain[hip];
    }
  }
  return out;
}

double leg_length(const Skeleton& s, const Leg& leg) {
  const std::vector<int> chain = above(s, leg.ankle, leg.hip);
  return along(s, chain, 0, chain.size());
}

void find_toe(const Skeleton& s, Leg& leg, double length) {
  double best = 0;
  for (int j = leg.ankle + 1; j < s.joint_count(); ++j) {
    if (s.joints[j].parent != leg.ankle || bone(s, j) < 0.03 * length) continue;
    const std::string p = plain(s.joints[j].name);
    const double score = bone(s, j) + (has(p, "toe") || has(p, "ball") ? 1e6 : 0);
    if (score > best) {
      best = score;
      leg.toe = j;
    }
  }
}

Feet with_toes(const Skeleton& s, Leg left, Leg right) {
  Feet out{.legs = {left, right}, .root = s.travel_root()};
  out.leg_length_cm = (leg_length(s, left) + leg_length(s, right)) / 2;
  for (Leg& leg : out.legs) find_toe(s, leg, out.leg_length_cm);
  return out;
}

bool mirrored(const Skeleton& s, const Leg& a, const Leg& b) {
  const double la = leg_length(s, a);
  const double lb = leg_length(s, b);
  const auto near = [](double x, double y) { return std::abs(x - y) <= unequal * std::max(x, y); };
  return a.hip != b.hip && a.knee != b.knee && near(la, lb) && near(bone(s, a.ankle), bone(s, b.ankle));
}

std::optional<Feet> by_name(const Clip& clip, const Stance& stance) {
  const Skeleton& s = clip.skeleton;
  const int root = s.travel_root();
  std::array<std::optional<Leg>, 2> found;
  for (int j = 0; j < s.joint_count(); ++j) {
    const std::string& name = s.joints[j].name;
    const int side = names_ankle(name) ? side_of(name) : -1;
    if (side < 0 || found[side]) continue;
    const Leg leg = leg_above(s, stance, j, root);
    if (leg.hip >= 0) found[side] = leg;
  }
  if (!found[0] || !found[1] || found[0]->hip == found[1]->hip) return std::nullopt;
  return with_toes(s, *found[0], *found[1]);
}

// Whether `a` is the left leg: by name, else seen along the feet (or, without toes, along the bend of the knees).
bool is_left(const Skeleton& s, const Stance& stance, const Feet& feet) {
  const Leg& a = feet.legs[0];
  const Leg& b = feet.legs[1];
  const int named = side_of(s.joints[a.ankle].name);
  if (named >= 0 && named != side_of(s.joints[b.ankle].name)) return named == 0;
  double sum = 0;
  for (int f = 0; f < stance.positions.frames; ++f) {
    const auto at = [&](int joint) { return stance.positions.at(f, joint); };
    Eigen::Vector3d ahead = Eigen::Vector3d::Zero();
    for (const Leg& leg : feet.legs) {
      if (leg.toe >= 0) ahead += at(leg.toe) - at(leg.ankle);
      if (leg.toe < 0) ahead += at(leg.knee) - (at(leg.hip) + at(leg.ankle)) / 2;
    }
    sum += Eigen::Vector3d::UnitY().cross(ahead).dot(at(a.hip) - at(b.hip));
  }
  return sum >= 0;
}

// The lowest mirrored pair of chains with two long bones each.
std::optional<Feet> by_shape(const Clip& clip, const Stance& stance) {
  const Skeleton& s = clip.skeleton;
  const int root = s.travel_root();
  const auto [low, high] = std::ranges::minmax(stance.height);
  std::vector<Leg> candidates;
  for (int j = 0; j < s.joint_count(); ++j) {
    const Leg leg = leg_above(s, stance, j, root);
    if (leg.hip < 0) continue;
    const double length = leg_length(s, leg);
    const double shin = along(s, above(s, j, leg.knee), 0, above(s, j, leg.knee).size());
    const bool leglike = length >= 0.25 * (high - low) && shin >= 0.35 * length && shin <= 0.65 * length;
    const bool hangs = stance.height[leg.hip] - stance.height[j] > 0.3 * length;
    if (leglike && hangs && stance.height[j] < low + 0.3 * (high - low)) candidates.push_back(leg);
  }
  std::optional<Feet> best;
  double best_score = 0;
  for (std::size_t a = 0; a < candidates.size(); ++a) {
    for (std::size_t b = a + 1; b < candidates.size(); ++b) {
      if (!mirrored(s, candidates[a], candidates[b])) continue;
      const Feet feet = with_toes(s, candidates[a], candidates[b]);
      // A knee bends: of chains through the same joints the one whose two bones are most alike.
      const double shin = bone(s, candidates[a].ankle);
      const double score = feet.leg_length_cm - 2 * std::abs(shin - feet.leg_length_cm / 2) -
                           (stance.height[candidates[a].ankle] + stance.height[candidates[b].ankle] - 2 * low);
      if (best && score <= best_score) continue;
      best = feet;
      best_score = score;
    }
  }
  if (best && !is_left(s, stance, *best)) std::swap(best->legs[0], best->legs[1]);
  return best;
}

Leg named_leg(const Clip& clip, const Stance& stance, const std::string& name) {
  const int ankle = clip.skeleton.find(name);
  const char* remedy = "name the two ankle joints: --feet LEFT,RIGHT";
  if (ankle < 0) {
    throw Error(ErrorKind::bad_input, {.file = clip.name,
                                       .found = fmt::format("no joint called \"{}\"", name),
                                       .expected = "the name of an ankle joint",
                                       .remedy = remedy});
  }
  const Leg leg = leg_above(clip.skeleton, stance, ankle, clip.skeleton.travel_root());
  if (leg.hip < 0) {
    throw Error(ErrorKind::bad_input, {.file = clip.name,
                                       .found = fmt::format("no knee and hip above \"{}\"", name),
                                       .expected = "an ankle with a knee and a hip above it, below the root",
                                       .remedy = remedy});
  }
  return leg;
}

}  // namespace

FeetNames FeetNames::parse(const std::string& text) {
  const std::size_t comma = text.find(',');
  FeetNames out;
  if (comma != std::string::npos) out = {text.substr(0, comma), text.substr(comma + 1)};
  if (out.left.empty() || out.right.empty() || out.left == out.right) {
    throw Error(ErrorKind::usage, {.found = fmt::format("the feet \"{}\"", text),
                                   .expected = "the names of two ankle joints",
                                   .remedy = "write them as LEFT,RIGHT"});
  }
  return out;
}

std::optional<Feet> find_feet(const Clip& clip, const FeetNames& names) {
  const Stance stance = stance_of(clip);
  if (names.given()) {
    return with_toes(clip.skeleton, named_leg(clip, stance, names.left), named_leg(clip, stance, names.right));
  }
  const std::optional<Feet> named = by_name(clip, stance);
  return named ? named : by_shape(clip, stance);
}

Feet require_feet(const Clip& clip, const FeetNames& names) {
  if (const auto feet = find_feet(clip, names)) return *feet;
  throw Error(ErrorKind::bad_input,
              {.file = clip.name,
               .found = fmt::format("no feet among {} joints", clip.skeleton.joint_count()),
               .expected = "two legs of hip, knee and ankle, by name or as the lowest mirrored pair of limbs",
               .remedy = "name the two ankle joints: --feet LEFT,RIGHT"});
}

}  // namespace kinespace
