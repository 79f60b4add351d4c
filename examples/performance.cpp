#include "examples/performance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace::samples {
namespace {

// q and -q are the same rotation; the one nearer to the frame before lets the tracks run on smoothly.
void keep_hemisphere(Clip& clip) {
  for (int joint = 0; joint < clip.skeleton.joint_count(); ++joint) {
    const Eigen::Quaterniond first = clip.rotation(joint, 0);
    if (first.w() < 0) clip.set_rotation(joint, 0, Eigen::Quaterniond(-first.coeffs()));
    for (int f = 1; f < clip.frames; ++f) {
      const Eigen::Quaterniond q = clip.rotation(joint, f);
      if (q.dot(clip.rotation(joint, f - 1)) < 0) clip.set_rotation(joint, f, Eigen::Quaterniond(-q.coeffs()));
    }
  }
}

std::vector<Contact> contacts_of(const FootTrack& track, int side, double rate_hz, int frames) {
  constexpr double rounding = 1e-9;  // frames; a frame this near to the end of a stand belongs to it
  std::vector<Contact> out;
  for (const Stand& stand : track.stands()) {
    const double first = std::max(0.0, std::ceil(stand.first * rate_hz - rounding));
    const double last = std::min(frames - 1.0, std::floor(stand.last * rate_hz + rounding));
    if (first > last) continue;
    out.push_back({.side = side == 0 ? Side::left : Side::right,
                   .joint = of_side(stand.toe ? joint::toe : joint::foot, side),
                   .first_frame = static_cast<int>(first),
                   .last_frame = static_cast<int>(last)});
  }
  return out;
}

}  // namespace

Performance::Performance(const TakeOptions& take_options, double seconds)
    : take(take_options), duration_s(seconds), skeleton(sample_skeleton(take.height_cm)), build(skeleton) {}

BodyPose Performance::pose(double t) const {
  BodyPose out = body(t);
  for (std::size_t side = 0; side < 2; ++side) out.feet[side] = feet[side].at(t);
  return out;
}

double Performance::room_above(double first, double last, double reach) const {
  constexpr double step = 1.0 / 480;
  double room = std::numeric_limits<double>::infinity();
  for (double t = first; t < last + step; t += step) {
    const BodyPose at = pose(t);
    room = std::min(room, highest_hips(build, at, reach) - at.hips.y());
  }
  return room;
}

void Performance::lift_hips(double by_cm) {
  body = [inner = std::move(body), by_cm](double t) {
    BodyPose out = inner(t);
    out.hips.y() += by_cm;
    return out;
  };
}

void Performance::stand_tall(double reach, double window_s) {
  // The lowest limit within the window, then averaged over the window by a smooth bump, never exceeds the limit itself:
  // each averaged minimum saw the limit at t.
  constexpr double step = 1.0 / 240;
  const int around = static_cast<int>(std::ceil(window_s / step));
  const int samples = static_cast<int>(std::ceil(duration_s / step)) + 4 * around + 2;
  const double start = -2 * around * step;
  std::vector<double> limit;
  for (int i = 0; i < samples; ++i) limit.push_back(highest_hips(build, pose(start + i * step), reach));
  auto lowest = std::make_shared<std::vector<double>>(limit);
  for (int i = 0; i < samples; ++i) {
    const auto first = limit.begin() + std::max(0, i - around);
    (*lowest)[static_cast<std::size_t>(i)] =
        *std::min_element(first, limit.begin() + std::min(samples, i + around + 1));
  }
  body = [inner = std::move(body), lowest, around, start](double t) {
    const double place = (t - start) / step;
    double sum = 0;
    double weights = 0;
    for (int i = static_cast<int>(std::ceil(place)) - around; i <= static_cast<int>(std::floor(place)) + around; ++i) {
      const double w = bump(0.5 + 0.5 * (i - place) / around, 4, 4);
      const int inside = std::clamp(i, 0, static_cast<int>(lowest->size()) - 1);
      sum += w * (*lowest)[static_cast<std::size_t>(inside)];
      weights += w;
    }
    BodyPose out = inner(t);
    out.hips.y() = sum / weights;
    return out;
  };
}

SampleMotion Performance::perform(std::string name, std::vector<std::string> labels) const {
  const int frames = static_cast<int>(std::lround(duration_s * take.rate_hz)) + 1;
  SampleMotion out{
      .clip = make_clip(std::move(name), skeleton, take.rate_hz, frames), .labels = std::move(labels), .contacts = {}};
  for (int f = 0; f < frames; ++f) set_pose(out.clip, f, build, pose(f / take.rate_hz));
  keep_hemisphere(out.clip);
  for (int side = 0; side < 2; ++side) {
    const auto more = contacts_of(feet[static_cast<std::size_t>(side)], side, take.rate_hz, frames);
    out.contacts.insert(out.contacts.end(), more.begin(), more.end());
  }
  return out;
}

Plant standing_plant(const Build& build, const Eigen::Vector2d& middle, double heading, int side) {
  const double outwards = side == 0 ? 1 : -1;
  const double yaw = heading + outwards * 8 * degree;
  const double width = 1.15 * build.left_hip.x();
  const double ankle_back = 0.012 * build.standing;  // the weight is over the middle of the foot, in front of the ankle
  Plant plant;
  plant.toe = middle + outwards * width * leftwards(heading) - ankle_back * forwards(heading) +
              build.foot.ankle_to_toe * forwards(yaw);
  plant.yaw = yaw;
  return plant;
}

std::vector<FootTrack> standing_feet(const Build& build, double heading) {
  std::vector<FootTrack> out;
  for (int side = 0; side < 2; ++side) {
    out.emplace_back(build.foot, std::vector{standing_plant(build, Eigen::Vector2d::Zero(), heading, side)});
  }
  return out;
}

std::uint64_t salted(std::uint64_t seed, std::string_view salt) {
  std::uint64_t hash = 0xcbf29ce484222325U;  // FNV-1a
  for (const char c : salt) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return Random(seed ^ hash).next();
}

void require_range(std::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return;  // NaN is in no range
  throw Error(ErrorKind::usage, {.file = {},
                                 .line = 0,
                                 .found = fmt::format("{} = {}", field, value),
                                 .expected = fmt::format("{} to {}", low, high),
                                 .remedy = {}});
}

void require_style(std::string_view style) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
  };
  if (!style.empty() && style.size() <= 40 && std::ranges::all_of(style, fits)) return;
  throw Error(ErrorKind::usage, {.file = {},
                                 .line = 0,
                                 .found = fmt::format("style = \"{}\"", style),
                                 .expected = "1 to 40 letters, digits and hyphens",
                                 .remedy = {}});
}

}  // namespace kinespace::samples
