#include "kinespace/codecs/rma/contact_trajectories.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

constexpr double reach_of_floor_cm = 15;

void require_range(std::string_view field, double value, double least, bool open) {
  if (std::isfinite(value) && (open ? value > least : value >= least)) return;
  throw Error(ErrorKind::usage, {.found = fmt::format("ContactOptions::{} = {}", field, value),
                                 .expected = fmt::format("{} {}", open ? "more than" : "at least", least)});
}

// The mean of the lowest cluster: of bins of 1 cm the lowest stretch of three that holds a twelfth of the values and no
// fewer than the three above it.
double lowest_cluster(const std::vector<double>& values) {
  const auto [low, high] = std::ranges::minmax(values);
  const auto bins = static_cast<std::size_t>(std::min(high - low, 1e4)) + 4;
  std::vector<int> count(bins, 0);
  for (const double v : values) ++count[static_cast<std::size_t>(std::min(v - low, static_cast<double>(bins - 4)))];
  const auto stretch = [&](std::size_t b) { return b + 2 < bins ? count[b] + count[b + 1] + count[b + 2] : 0; };
  const int enough = static_cast<int>(values.size() / 12) + 1;
  std::size_t at = 0;
  while (at + 3 < bins && (stretch(at) < enough || stretch(at) < stretch(at + 1))) ++at;
  double sum = 0;
  int number = 0;
  for (const double v : values) {
    const double place = v - low;
    if (place < static_cast<double>(at) || place >= static_cast<double>(at + 3)) continue;
    sum += v;
    ++number;
  }
  return number > 0 ? sum / number : low;
}

struct Resting {
  int joint = 0;
  double height = 0;
};

// take(frame, positions of all joints at it), some frames of the clip at a time.
template <typename Take>
void visit_positions(const Clip& clip, const Take& take) {
  constexpr int block = 1024;
  for (int first = 0; first < clip.frames; first += block) {
    const JointPositions positions = joint_positions(slice(clip, first, std::min(block, clip.frames - first)));
    for (int f = 0; f < positions.frames; ++f) {
      take(static_cast<std::size_t>(first + f), &positions.at(f, 0));
    }
  }
}

std::vector<Resting> resting_joints(const Clip& clip) {
  const auto joints = static_cast<std::size_t>(clip.skeleton.joint_count());
  std::vector<std::vector<double>> heights(joints, std::vector<double>(static_cast<std::size_t>(clip.frames)));
  visit_positions(clip, [&](std::size_t frame, const Eigen::Vector3d* positions) {
    for (std::size_t j = 0; j < joints; ++j) heights[j][frame] = positions[j].y();
  });
  std::vector<Resting> out;
  double floor = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < joints; ++j) {
    out.push_back({static_cast<int>(j), lowest_cluster(heights[j])});
    floor = std::min(floor, out.back().height);
  }
  std::erase_if(out, [&](const Resting& r) { return r.height > floor + reach_of_floor_cm; });
  return out;
}

// By resting joint: where it is at every frame.
std::vector<std::vector<Eigen::Vector3d>> paths_of(const Clip& clip, std::span<const Resting> resting) {
  std::vector<std::vector<Eigen::Vector3d>> out(resting.size(),
                                                std::vector<Eigen::Vector3d>(static_cast<std::size_t>(clip.frames)));
  visit_positions(clip, [&](std::size_t frame, const Eigen::Vector3d* positions) {
    for (std::size_t r = 0; r < resting.size(); ++r) out[r][frame] = positions[resting[r].joint];
  });
  return out;
}

// cm/s, over 80 ms about the frame.
double speed_at(std::span<const Eigen::Vector3d> path, double rate_hz, int frame) {
  const int reach = std::max(1, static_cast<int>(0.04 * rate_hz));
  const int first = std::max(0, frame - reach);
  const int last = std::min(static_cast<int>(path.size()) - 1, frame + reach);
  if (first == last) return 0;
  return (path[static_cast<std::size_t>(last)] - path[static_cast<std::size_t>(first)]).norm() * rate_hz /
         (last - first);
}

std::int8_t steps(double value, double step, int most) {
  return static_cast<std::int8_t>(std::clamp<long>(std::lround(value / step), -most, most));
}

}  // namespace

void ContactOptions::validate() const {
  require_range("near_cm", near_cm, 0, false);
  require_range("slow_cm_s", slow_cm_s, 0, false);
  require_range("move_cm", move_cm, 0, true);
  require_range("shortest_s", shortest_s, 0, false);
  require_range("still_cm", still_cm, 0, false);
}

std::vector<ContactTrack> find_contacts(const Clip& clip, const ContactOptions& options) {
  options.validate();
  const std::vector<Resting> resting = resting_joints(clip);
  const std::vector<std::vector<Eigen::Vector3d>> paths = paths_of(clip, resting);
  const auto shortest = static_cast<std::size_t>(std::max(2.0, std::ceil(options.shortest_s * clip.rate_hz)));
  std::vector<ContactTrack> out;
  for (std::size_t r = 0; r < resting.size(); ++r) {
    ContactTrack track{.joint = resting[r].joint, .first = 0, .points = {}};
    const auto finish = [&] {
      if (track.points.size() >= shortest) out.push_back(track);
      track.points.clear();
    };
    for (int f = 0; f < clip.frames; ++f) {
      const Eigen::Vector3d& p = paths[r][static_cast<std::size_t>(f)];
      const bool near = std::abs(p.y() - resting[r].height) <= options.near_cm;
      const bool touches = near || speed_at(paths[r], clip.rate_hz, f) <= options.slow_cm_s;
      const bool moved = !track.points.empty() && (p - track.points.back()).norm() > options.move_cm;
      if (!touches || moved) finish();
      if (!touches) continue;
      if (track.points.empty()) track.first = f;
      track.points.push_back(p);
    }
    finish();
  }
  return out;
}

std::vector<Eigen::Vector3d> joint_path(const Clip& clip, int joint, int first, int count) {
  std::vector<int> chain;
  for (int j = joint; j >= 0; j = clip.skeleton.joints[static_cast<std::size_t>(j)].parent) chain.push_back(j);
  std::ranges::reverse(chain);
  std::vector<Eigen::Vector3d> out(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    for (const int j : chain) {
      at += turn * clip.translation(j, first + i);
      if (j != joint) turn = turn * clip.rotation(j, first + i).toRotationMatrix();
    }
    out[static_cast<std::size_t>(i)] = at;
  }
  return out;
}

std::vector<ContactCode> code_contacts(std::span<const ContactTrack> tracks, const Clip& decoded,
                                       const ContactOptions& options) {
  std::vector<ContactCode> out;
  for (const ContactTrack& track : tracks) {
    const auto path = joint_path(decoded, track.joint, track.first, static_cast<int>(track.points.size()));
    std::size_t start = 0;
    while (start < path.size() && (track.points[start] - path[start]).norm() > ContactCode::farthest_off_cm) ++start;
    if (path.size() - start < 2) continue;
    ContactCode code{.joint = track.joint, .first = track.first + static_cast<int>(start), .start = {}, .moves = {}};
    Eigen::Vector3d at = path[start];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      code.start[k] =
          steps(track.points[start][axis] - at[axis], ContactCode::start_step_cm, ContactCode::farthest_start);
      at[axis] += code.start[k] * ContactCode::start_step_cm;
    }
    for (std::size_t i = start + 1; i < track.points.size(); ++i) {
      std::array<std::int8_t, 3> move{};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        const double off = track.points[i][axis] - at[axis];
        if (std::abs(off) <= options.still_cm) continue;
        move[k] = steps(off, ContactCode::move_step_cm, ContactCode::farthest_move);
        at[axis] += move[k] * ContactCode::move_step_cm;
      }
      code.moves.push_back(move);
    }
    out.push_back(std::move(code));
  }
  return out;
}

std::vector<ContactTrack> contact_tracks(std::span<const ContactCode> codes, const Clip& decoded) {
  constexpr double smoothing_s = 0.03;  // to either side
  std::vector<ContactTrack> out;
  const auto reach = static_cast<std::ptrdiff_t>(std::min(smoothing_s * decoded.rate_hz, 1e4));
  for (const ContactCode& code : codes) {
    ContactTrack track{.joint = code.joint, .first = code.first, .points = {}};
    Eigen::Vector3d at = joint_path(decoded, code.joint, code.first, 1).front();
    at += ContactCode::start_step_cm * Eigen::Vector3d(code.start[0], code.start[1], code.start[2]);
    // Running sums, so that the mean takes no longer for more frames.
    std::vector<Eigen::Vector3d> sums{Eigen::Vector3d::Zero()};
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    sums.push_back(moved);
    for (const auto& move : code.moves) {
      moved += ContactCode::move_step_cm * Eigen::Vector3d(move[0], move[1], move[2]);
      sums.emplace_back(sums.back() + moved);
    }
    const auto frames = static_cast<std::ptrdiff_t>(code.frames());
    for (std::ptrdiff_t f = 0; f < frames; ++f) {
      const std::ptrdiff_t near = std::min({reach, f, frames - 1 - f});
      const auto first = static_cast<std::size_t>(f - near);
      const auto last = static_cast<std::size_t>(f + near + 1);
      track.points.emplace_back(at + (sums[last] - sums[first]) / static_cast<double>(last - first));
    }
    out.push_back(std::move(track));
  }
  return out;
}

namespace {

enum Context : int { count, joint, first_frame, length, start_x, moved_before = 8, move_x = 11 };

}  // namespace

void put_contacts(ValueWriter& out, std::span<const ContactCode> codes) {
  out.put(static_cast<std::int64_t>(codes.size()), count);
  int last_joint = 0;
  int last_frame = 0;
  for (const ContactCode& code : codes) {
    out.put(code.joint - last_joint, joint);
    if (code.joint != last_joint) last_frame = 0;
    out.put(code.first - last_frame, first_frame);
    out.put(code.frames() - 1, length);
    for (int k = 0; k < 3; ++k) out.put(code.start[static_cast<std::size_t>(k)], start_x + k);
    int before = 0;
    for (const auto& move : code.moves) {
      const bool moves = move != std::array<std::int8_t, 3>{};
      out.put_bit(moves, moved_before + before);
      before = moves ? 2 : std::max(0, before - 1);
      if (!moves) continue;
      for (int k = 0; k < 3; ++k) out.put(move[static_cast<std::size_t>(k)], move_x + k);
    }
    last_joint = code.joint;
    last_frame = code.first + code.frames();
  }
}

std::vector<ContactCode> get_contacts(ValueReader& in, int frames, int joints, std::int64_t& numbers) {
  std::vector<ContactCode> out;
  const std::int64_t codes = in.get_between(0, static_cast<std::int64_t>(frames) * joints, count);
  int last_joint = 0;
  int last_frame = 0;
  for (std::int64_t i = 0; i < codes; ++i) {
    ContactCode code;
    code.joint = static_cast<int>(last_joint + in.get_between(0, joints, joint));
    if (code.joint >= joints) in.damaged();
    if (code.joint != last_joint) last_frame = 0;
    code.first = static_cast<int>(last_frame + in.get_between(0, frames, first_frame));
    const std::int64_t size = 1 + in.get_between(0, frames, length);
    numbers -= 16 + size;
    if (code.first + size > frames || numbers < 0) in.damaged();
    for (int k = 0; k < 3; ++k) {
      constexpr int most = ContactCode::farthest_start;
      code.start[static_cast<std::size_t>(k)] = static_cast<std::int8_t>(in.get_between(-most, most, start_x + k));
    }
    code.moves.resize(static_cast<std::size_t>(size - 1));
    int before = 0;
    for (auto& move : code.moves) {
      const bool moves = in.get_bit(moved_before + before);
      before = moves ? 2 : std::max(0, before - 1);
      if (!moves) continue;
      for (int k = 0; k < 3; ++k) {
        constexpr int most = ContactCode::farthest_move;
        move[static_cast<std::size_t>(k)] = static_cast<std::int8_t>(in.get_between(-most, most, move_x + k));
      }
    }
    last_joint = code.joint;
    last_frame = code.first + code.frames();
    out.push_back(std::move(code));
  }
  return out;
}

}  // namespace kinespace
