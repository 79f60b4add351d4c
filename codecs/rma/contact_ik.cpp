#include "kinespace/codecs/rma/contact_ik.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ranges>

#include "kinespace/codecs/rma/root_alignment.h"

namespace kinespace {
namespace {

constexpr double damping_cm = 2;
constexpr double near_enough_cm = 0.02;
constexpr double largest_turn = 0.5;  // radians in one round
constexpr int most_rounds = 12;
constexpr int turning_joints = 2;

// (m + damping)^-1 e of a symmetric matrix, by its adjugate.
Eigen::Vector3d solve(const Eigen::Matrix3d& m, const Eigen::Vector3d& e) {
  const double a = m(0, 0), b = m(0, 1), c = m(0, 2), d = m(1, 1), f = m(1, 2), g = m(2, 2);
  const double aa = d * g - f * f;
  const double ab = c * f - b * g;
  const double ac = b * f - c * d;
  const double dd = a * g - c * c;
  const double df = b * c - a * f;
  const double gg = a * d - b * b;
  const double scale = 1 / (a * aa + b * ab + c * ac);
  return {scale * (aa * e.x() + ab * e.y() + ac * e.z()), scale * (ab * e.x() + dd * e.y() + df * e.z()),
          scale * (ac * e.x() + df * e.y() + gg * e.z())};
}

// The joints from joint 0 to a touching one, and those of them that turn.
struct Limb {
  int joint = 0;
  std::vector<int> path;
  std::size_t most_turning = 0;
  std::vector<double> weight;         // by frame: 0 where nothing is corrected, 1 in a contact
  std::vector<Eigen::Vector3d> goal;  // by frame: where the joint would be in contact
};

class Solver {
 public:
  // Turns the joints path[turning..] of one frame until the last is at the goal, or `weight` of the way there.
  // `turning` falls (from the limb's end upwards).
  void solve_frame(Clip& clip, int frame, const std::vector<int>& path, std::span<const std::size_t> turning,
                   const Eigen::Vector3d& goal, double weight) {
    const std::size_t n = path.size();
    local_.resize(n);
    world_.resize(n);
    at_.resize(n);
    offset_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      local_[i] = clip.rotation(path[i], frame);
      offset_[i] = clip.translation(path[i], frame);
    }
    forward(0);
    const Eigen::Vector3d target = at_[n - 1] + weight * (goal - at_[n - 1]);
    best_ = local_;
    double least = (target - at_[n - 1]).squaredNorm();
    bool moved = false;
    for (int round = 0; round < most_rounds && least > near_enough_cm * near_enough_cm; ++round) {
      turn_towards(target - at_[n - 1], turning);
      forward(turning.back());
      const double left = (target - at_[n - 1]).squaredNorm();
      if (!(left < least)) break;
      least = left;
      best_ = local_;
      moved = true;
    }
    for (const std::size_t i : turning) {
      if (moved) clip.set_rotation(path[i], frame, best_[i].normalized());
    }
  }

 private:
  void forward(std::size_t from) {
    for (std::size_t i = from; i < local_.size(); ++i) {
      at_[i] = i == 0 ? offset_[i] : Eigen::Vector3d(at_[i - 1] + world_[i - 1] * offset_[i]);
      const Eigen::Matrix3d own = local_[i].toRotationMatrix();
      world_[i] = i == 0 ? own : Eigen::Matrix3d(world_[i - 1] * own);
    }
  }
  void turn_towards(const Eigen::Vector3d& e, std::span<const std::size_t> turning) {
    const Eigen::Vector3d& end = at_.back();
    Eigen::Matrix3d jj = (damping_cm * damping_cm + e.squaredNorm()) * Eigen::Matrix3d::Identity();
    for (const std::size_t i : turning) {
      const Eigen::Vector3d r = end - at_[i];
      jj += r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose();
    }
    const Eigen::Vector3d y = solve(jj, e);
    for (const std::size_t i : turning) {
      Eigen::Vector3d w = (end - at_[i]).cross(y);
      const double size = w.norm();
      if (size > largest_turn) w *= largest_turn / size;
      if (i > 0) w = world_[i - 1].transpose() * w;
      local_[i] = from_rodrigues(w) * local_[i];
    }
  }

  std::vector<Eigen::Quaterniond> local_;
  std::vector<Eigen::Quaterniond> best_;
  std::vector<Eigen::Matrix3d> world_;
  std::vector<Eigen::Vector3d> at_;
  std::vector<Eigen::Vector3d> offset_;
};

// `before`, `after`: over how many frames the correction fades on either side.
void add_track(const Clip& clip, const ContactTrack& track, int before, int after, Limb& limb) {
  const int count = static_cast<int>(track.points.size());
  const int last = track.first + count;
  for (int i = 0; i < count; ++i) {
    const auto f = static_cast<std::size_t>(track.first + i);
    limb.weight[f] = 1;
    limb.goal[f] = track.points[static_cast<std::size_t>(i)];
  }
  const int from = std::max(0, track.first - before);
  const int to = std::min(clip.frames, last + after);
  const auto path_before = joint_path(clip, limb.joint, from, track.first - from + 1);
  const auto path_after = joint_path(clip, limb.joint, last - 1, to - last + 1);
  const Eigen::Vector3d first_off = track.points.front() - path_before.back();
  const Eigen::Vector3d last_off = track.points.back() - path_after.front();
  // Two contacts that are near fade into each other: both corrections, by weight.
  const auto fade = [&](int frame, double u, const Eigen::Vector3d& own, const Eigen::Vector3d& off) {
    const auto f = static_cast<std::size_t>(frame);
    const double weight = u * u * (3 - 2 * u);
    const double both = limb.weight[f] + weight;
    limb.goal[f] = (limb.weight[f] * limb.goal[f] + weight * (own + off)) / both;
    limb.weight[f] = std::min(both, 1.0);
  };
  for (int f = from; f < track.first; ++f) {
    const double u = 1 - static_cast<double>(track.first - f) / (before + 1);
    fade(f, u, path_before[static_cast<std::size_t>(f - from)], first_off);
  }
  for (int f = last; f < to; ++f) {
    const double u = 1 - static_cast<double>(f - last + 1) / (after + 1);
    fade(f, u, path_after[static_cast<std::size_t>(f - last + 1)], last_off);
  }
}

std::vector<Limb> limbs_of(const Clip& clip, std::span<const ContactTrack> tracks, double blending_s) {
  const auto frames = static_cast<std::size_t>(clip.frames);
  const int blending = static_cast<int>(std::min(std::ceil(blending_s * clip.rate_hz), 1e4));
  std::vector<Limb> out;
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    const ContactTrack& track = tracks[t];
    const auto end_of = [](const ContactTrack& one) { return one.first + static_cast<int>(one.points.size()); };
    const bool follows = t > 0 && tracks[t - 1].joint == track.joint;
    const bool leads = t + 1 < tracks.size() && tracks[t + 1].joint == track.joint;
    const int before = follows ? std::clamp(track.first - end_of(tracks[t - 1]), 0, blending) : blending;
    const int after = leads ? std::clamp(tracks[t + 1].first - end_of(track), 0, blending) : blending;
    if (out.empty() || out.back().joint != track.joint) {
      Limb limb{
          .joint = track.joint,
          .path = {},
          .most_turning = turning_joints,
          .weight = {},
          .goal = {},
      };
      for (int j = track.joint; j >= 0; j = clip.skeleton.joints[static_cast<std::size_t>(j)].parent)
        limb.path.push_back(j);
      std::ranges::reverse(limb.path);
      for (const Limb& other : out) {
        if (std::ranges::find(limb.path, other.joint) != limb.path.end()) ++limb.most_turning;
      }
      limb.weight.assign(frames, 0.0);
      limb.goal.assign(frames, Eigen::Vector3d::Zero());
      out.push_back(std::move(limb));
    }
    add_track(clip, track, before, after, out.back());
  }
  return out;
}

// The joints of a limb's path that turn, from its end upwards: at most so many, none above joint `below`.
void choose_turning(const Clip& clip, const Limb& limb, std::size_t most, int below, std::vector<std::size_t>& out) {
  const int root = clip.skeleton.travel_root();
  out.clear();
  for (std::size_t i = limb.path.size() - 1; i-- > 0 && out.size() < most;) {
    const int joint = limb.path[i];
    if (joint <= root || joint < below) break;
    if (clip.skeleton.joints[static_cast<std::size_t>(joint)].has_rotation()) out.push_back(i);
  }
}

void hold_limb(Clip& clip, const Limb& limb, std::span<const std::size_t> turning, Solver& solver) {
  if (turning.empty()) return;
  for (int f = 0; f < clip.frames; ++f) {
    const auto frame = static_cast<std::size_t>(f);
    if (limb.weight[frame] == 0) continue;
    solver.solve_frame(clip, f, limb.path, turning, limb.goal[frame], limb.weight[frame]);
  }
}

}  // namespace

void hold_contacts(Clip& clip, std::span<const ContactTrack> tracks, double blending_s) {
  const std::vector<Limb> limbs = limbs_of(clip, tracks, blending_s);
  Solver solver;
  std::vector<std::size_t> turning;
  // Children first (a toe takes the leg along), then their parents (an ankle has its own place) ...
  for (const Limb& limb : std::views::reverse(limbs)) {
    choose_turning(clip, limb, limb.most_turning, 0, turning);
    hold_limb(clip, limb, turning, solver);
  }
  // ... and what that took from the children, by turning about the nearest such parent.
  for (const Limb& limb : limbs) {
    int nearest = -1;
    for (const Limb& other : limbs) {
      const bool above = other.joint != limb.joint && std::ranges::find(limb.path, other.joint) != limb.path.end();
      if (above) nearest = std::max(nearest, other.joint);
    }
    if (nearest < 0) continue;
    choose_turning(clip, limb, limb.path.size(), nearest, turning);
    hold_limb(clip, limb, turning, solver);
  }
}

}  // namespace kinespace
