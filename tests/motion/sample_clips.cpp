#include "tests/motion/sample_clips.h"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "kinespace/motion/euler.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace::test {

Skeleton branched_skeleton() {
  using enum Channel;
  Skeleton s;
  s.joints.push_back({.name = "Hips",
                      .parent = -1,
                      .offset = {0, 90, 0},
                      .channels = {x_position, y_position, z_position, z_rotation, x_rotation, y_rotation}});
  s.joints.push_back(
      {.name = "Spine", .parent = 0, .offset = {0, 12, -1}, .channels = {x_rotation, y_rotation, z_rotation}});
  s.joints.push_back({.name = "Head",
                      .parent = 1,
                      .offset = {0, 50, 3},
                      .channels = {y_rotation, x_rotation},
                      .end_site = Eigen::Vector3d(0, 20, 0)});
  s.joints.push_back({.name = "Left Arm",
                      .parent = 1,
                      .offset = {18, 45, 0},
                      .channels = {z_rotation, y_rotation, x_position, x_rotation, y_position, z_position}});
  s.joints.push_back(
      {.name = "Left Hand", .parent = 3, .offset = {30, 0, 0}, .channels = {}, .end_site = Eigen::Vector3d(9, 0, 0)});
  s.joints.push_back(
      {.name = "Left Leg", .parent = 0, .offset = {9, -5, 0}, .channels = {y_rotation, z_rotation, x_rotation}});
  s.joints.push_back({.name = "Left Foot",
                      .parent = 5,
                      .offset = {0, -80, 0},
                      .channels = {x_rotation},
                      .end_site = Eigen::Vector3d(0, -2, 12)});
  return s;
}

Clip random_clip(std::uint32_t seed, int frames) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> step(-12, 12);
  Clip clip = make_clip("random", branched_skeleton(), 30, frames);
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    const Joint& joint = clip.skeleton.joints[static_cast<std::size_t>(j)];
    const EulerOrder order = euler_order(joint.channels);
    EulerAngles angles{};
    Eigen::Vector3d place = joint.offset;
    for (int f = 0; f < frames; ++f) {
      Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
      for (std::size_t c = 0; c < static_cast<std::size_t>(order.given); ++c) {
        angles[c] += step(random);
        q = q * Eigen::AngleAxisd(angles[c] * M_PI / 180, Eigen::Vector3d::Unit(order.axes[c]));
      }
      clip.set_rotation(j, f, q);
      if (!joint.has_position()) continue;
      place += 0.1 * Eigen::Vector3d(step(random), step(random), step(random));
      clip.require_translation_track(j).values[static_cast<std::size_t>(f)] = place;
    }
  }
  return clip;
}

double largest_distance(const Clip& a, const Clip& b) {
  EXPECT_EQ(a.frames, b.frames);
  EXPECT_EQ(a.skeleton.joint_count(), b.skeleton.joint_count());
  if (a.frames != b.frames || a.skeleton.joint_count() != b.skeleton.joint_count()) return INFINITY;
  const JointPositions pa = joint_positions(a);
  const JointPositions pb = joint_positions(b);
  double largest = 0;
  for (std::size_t i = 0; i < pa.values.size(); ++i) largest = std::max(largest, (pa.values[i] - pb.values[i]).norm());
  return largest;
}

double largest_distance_by_name(const Clip& a, const Clip& b) {
  EXPECT_EQ(a.frames, b.frames);
  if (a.frames != b.frames) return INFINITY;
  const JointPositions pa = joint_positions(a);
  const JointPositions pb = joint_positions(b);
  double largest = 0;
  for (int j = 0; j < pa.joints; ++j) {
    const std::string& name = a.skeleton.joints[static_cast<std::size_t>(j)].name;
    const int other = j == 0 ? 0 : b.skeleton.find(name);
    EXPECT_GE(other, 0) << name;
    if (other < 0) return INFINITY;
    for (int f = 0; f < pa.frames; ++f) largest = std::max(largest, (pa.at(f, j) - pb.at(f, other)).norm());
  }
  return largest;
}

std::string what_is_wrong_with(const Clip& clip) {
  const auto frames = static_cast<std::size_t>(clip.frames);
  if (clip.frames < 1 || clip.skeleton.joints.empty()) return "no frames or joints";
  if (!(clip.rate_hz > 0) || !std::isfinite(clip.rate_hz)) return "rate";
  if (clip.rotations.size() != clip.skeleton.joints.size() * frames * 4) return "size of rotations";
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    const Joint& joint = clip.skeleton.joints[static_cast<std::size_t>(j)];
    if (joint.parent >= j || (joint.parent < 0) != (j == 0)) return "order of joints";
    if (joint.name.empty() || !joint.offset.allFinite() || joint.channels.size() > 6) return "joint";
    for (int f = 0; f < clip.frames; ++f) {
      if (!(std::abs(clip.rotation(j, f).norm() - 1) < 1e-9)) return "rotation of joint " + std::to_string(j);
    }
  }
  int before = -1;
  for (const auto& track : clip.translations) {
    if (track.joint <= before || track.joint >= clip.skeleton.joint_count()) return "order of tracks";
    if (track.values.size() != frames) return "size of a track";
    for (const auto& value : track.values) {
      if (!value.allFinite()) return "translation";
    }
    before = track.joint;
  }
  return {};
}

ErrorDetails error_of(const std::function<void()>& parse) {
  try {
    parse();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
    return error.details();
  }
  ADD_FAILURE() << "no error";
  return {};
}

std::string replaced(std::string_view text, std::string_view from, std::string_view to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string_view::npos) << from;
  if (at == std::string_view::npos) return std::string(text);
  return std::string(text.substr(0, at)) + std::string(to) + std::string(text.substr(at + from.size()));
}

std::string with_line(std::string_view text, int number, std::string_view line) {
  std::string out;
  for (int n = 1; !text.empty(); ++n) {
    const auto end = text.find('\n');
    const auto part = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (n != number) {
      out += std::string(part) + "\n";
    } else if (!line.empty()) {
      out += std::string(line) + "\n";
    }
  }
  return out;
}

}  // namespace kinespace::test
