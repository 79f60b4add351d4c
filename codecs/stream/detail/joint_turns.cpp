#include "kinespace/codecs/stream/detail/joint_turns.h"

#include <array>
#include <cmath>
#include <numbers>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

using Eigen::Quaterniond;

double nearest_turn(double angle, double near) {
  return angle + 360 * std::nearbyint((near - angle) / 360);
}

}  // namespace

JointTurns::JointTurns(const JointFreedom& freedom)
    : freedom_(freedom), before_(freedom.turn_before()), after_(freedom.turn_after()) {}

EulerAngles JointTurns::angles_of(const Quaterniond& rotation, const EulerAngles* near) const {
  const Quaterniond e = before_.conjugate() * rotation * after_.conjugate();
  const EulerAngles zero{};
  const EulerAngles& by = near != nullptr ? *near : zero;
  if (freedom_.turns == 3) return near != nullptr ? euler_angles(zyx, e, *near) : euler_angles(zyx, e);
  if (freedom_.turns == 2) {
    const EulerAngles all = euler_angles(zyx, e);
    return {nearest_turn(all[0], by[0]), freedom_.middle_degrees, nearest_turn(all[2], by[2])};
  }
  return {nearest_turn(2 * std::atan2(e.z(), e.w()) * 180 / std::numbers::pi, by[0]), 0, 0};
}

void JointTurns::angles(std::span<const Quaterniond> rotations, std::span<double> out) const {
  const std::size_t n = rotations.size();
  if (freedom_.turns == 0) return;
  EulerAngles now{};
  for (std::size_t f = 0; f < n; ++f) {
    now = angles_of(rotations[f], f > 0 ? &now : nullptr);
    out[f] = now[0];
    if (freedom_.turns == 2) out[n + f] = now[2];
    if (freedom_.turns != 3) continue;
    out[n + f] = now[1];
    out[2 * n + f] = now[2];
  }
}

void JointTurns::rotations(std::span<const double> angles, std::span<Quaterniond> out) const {
  const std::size_t n = out.size();
  if (freedom_.turns == 0) {
    for (Quaterniond& q : out) q = before_;
    return;
  }
  constexpr std::size_t block = 64;
  std::array<double, block> middle;
  std::array<double, block> none{};
  std::array<double, 4 * block> wxyz;
  middle.fill(freedom_.middle_degrees);
  for (std::size_t first = 0; first < n; first += block) {
    const std::size_t count = std::min(block, n - first);
    const double* a = angles.data() + first;
    const double* b = freedom_.turns == 3 ? a + n : middle.data();
    const double* c = freedom_.turns == 3 ? a + 2 * n : freedom_.turns == 2 ? a + n : none.data();
    quaternions_from_euler(zyx, a, b, c, static_cast<int>(count), wxyz.data());
    for (std::size_t f = 0; f < count; ++f) {
      const double* q = wxyz.data() + 4 * f;
      out[first + f] = before_ * Quaterniond(q[0], q[1], q[2], q[3]) * after_;
    }
  }
}

void append_turns(const Clip& clip, int joint, std::vector<Quaterniond>& out) {
  std::vector<int> above;
  if (joint == clip.skeleton.travel_root()) {
    for (int j = clip.skeleton.joints[static_cast<std::size_t>(joint)].parent; j >= 0;
         j = clip.skeleton.joints[static_cast<std::size_t>(j)].parent) {
      above.push_back(j);
    }
  }
  for (int f = 0; f < clip.frames; ++f) {
    Quaterniond q = clip.rotation(joint, f);
    for (const int j : above) q = clip.rotation(j, f) * q;
    const double square = q.squaredNorm();
    if (!(square > 1e-6 && square < 1e6)) {
      throw Error(ErrorKind::bad_input,
                  {.file = clip.name,
                   .found = "a rotation that is no number",
                   .expected = "unit quaternions, as of joint " +
                               clip.skeleton.joints[static_cast<std::size_t>(joint)].name + " in other frames"});
    }
    out.push_back(q.normalized());
  }
}

}  // namespace kinespace
