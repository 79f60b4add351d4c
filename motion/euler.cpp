#include "kinespace/motion/euler.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "kinespace/motion/simd.h"
#include "kinespace/motion/sine_cosine.h"

namespace kinespace {
namespace {

constexpr int block = 64;
constexpr double degrees_per_radian = 180 / std::numbers::pi;

// sin and cos of half the angles. The half angle is reduced to [-45, 45] degrees by whole right angles, in degrees and
// so without error.
KINESPACE_VECTOR_CLONES
void half_angle_sincos(const double* degrees, int count, double* sine, double* cosine) {
  constexpr double to_integer = 6755399441055744.0;  // 1.5 * 2^52: adding it leaves the integer in the low bits
  for (int i = 0; i < count; ++i) {
    const double shifted = degrees[i] * (1.0 / 180) + to_integer;
    const auto quadrant = std::bit_cast<std::uint64_t>(shifted);
    const double x = (degrees[i] - (shifted - to_integer) * 180) * (std::numbers::pi / 360);
    double s = 0, c = 0;
    sine_and_cosine_near_zero(x, s, c);
    const std::uint64_t swap = 0 - (quadrant & 1);
    const auto s_bits = std::bit_cast<std::uint64_t>(s);
    const auto c_bits = std::bit_cast<std::uint64_t>(c);
    sine[i] = std::bit_cast<double>(((s_bits & ~swap) | (c_bits & swap)) ^ ((quadrant & 2) << 62));
    cosine[i] = std::bit_cast<double>(((c_bits & ~swap) | (s_bits & swap)) ^ (((quadrant + 1) & 2) << 62));
  }
}

struct HalfAngles {
  alignas(64) std::array<double, block> sine;
  alignas(64) std::array<double, block> cosine;
};

// The product of the header, for the quaternion's numbers at I, J, K of w x y z.
template <int I, int J, int K>
void multiply(const HalfAngles& a, const HalfAngles& b, const HalfAngles& c, int count, double* out) {
  constexpr double e = (J - I + 3) % 3 == 1 ? 1 : -1;
  for (std::ptrdiff_t f = 0; f < count; ++f) {
    const double sa = a.sine[f], ca = a.cosine[f], sb = e * b.sine[f], cb = b.cosine[f], sc = c.sine[f],
                 cc = c.cosine[f];
    const double cacc = ca * cc, sasc = sa * sc, sacc = sa * cc, casc = ca * sc;
    out[4 * f] = cb * cacc - sb * sasc;
    out[4 * f + I] = cb * sacc + sb * casc;
    out[4 * f + J] = e * (sb * cacc - cb * sasc);
    out[4 * f + K] = cb * casc + sb * sacc;
  }
}

void multiply(const EulerOrder& order, const HalfAngles& a, const HalfAngles& b, const HalfAngles& c, int count,
              double* out) {
  switch (order.axes[0] * 3 + order.axes[1]) {
    case 0 * 3 + 1:
      return multiply<1, 2, 3>(a, b, c, count, out);
    case 0 * 3 + 2:
      return multiply<1, 3, 2>(a, b, c, count, out);
    case 1 * 3 + 0:
      return multiply<2, 1, 3>(a, b, c, count, out);
    case 1 * 3 + 2:
      return multiply<2, 3, 1>(a, b, c, count, out);
    case 2 * 3 + 0:
      return multiply<3, 1, 2>(a, b, c, count, out);
    default:
      return multiply<3, 2, 1>(a, b, c, count, out);
  }
}

// Half the sum and half the difference of a and c, and b, in radians; and how well the first two are defined.
struct Decomposed {
  double half_sum, half_difference, b;
  double sum_weight, difference_weight;
};

Decomposed decompose(const EulerOrder& order, const Eigen::Quaterniond& q) {
  const std::array<double, 3> v = {q.x(), q.y(), q.z()};
  const double e = order.parity();
  const double qi = v[static_cast<std::size_t>(order.axes[0])];
  const double qj = e * v[static_cast<std::size_t>(order.axes[1])];
  const double qk = v[static_cast<std::size_t>(order.axes[2])];
  const double sum = std::sqrt((qi + qk) * (qi + qk) + (q.w() + qj) * (q.w() + qj));
  const double difference = std::sqrt((qi - qk) * (qi - qk) + (q.w() - qj) * (q.w() - qj));
  return {.half_sum = std::atan2(qi + qk, q.w() + qj),
          .half_difference = std::atan2(qi - qk, q.w() - qj),
          .b = e * (2 * std::atan2(sum, difference) - std::numbers::pi / 2),
          .sum_weight = sum,
          .difference_weight = difference};
}

constexpr double lock = 1e-8;  // below this weight an angle is noise, and choosing it freely moves nothing

EulerAngles angles_keeping_a(const Decomposed& d, double a) {
  double c = d.half_sum - d.half_difference;
  if (d.difference_weight < lock) {
    c = 2 * d.half_sum - a;
  } else if (d.sum_weight < lock) {
    c = a - 2 * d.half_difference;
  } else {
    a = d.half_sum + d.half_difference;
  }
  return {a * degrees_per_radian, d.b * degrees_per_radian, c * degrees_per_radian};
}

double nearest_turn(double angle, double near) {
  return angle + 360 * std::nearbyint((near - angle) / 360);
}

EulerAngles nearest_turns(const EulerAngles& angles, const EulerAngles& near) {
  return {nearest_turn(angles[0], near[0]), nearest_turn(angles[1], near[1]), nearest_turn(angles[2], near[2])};
}

double squared_distance(const EulerAngles& x, const EulerAngles& y) {
  return (x[0] - y[0]) * (x[0] - y[0]) + (x[1] - y[1]) * (x[1] - y[1]) + (x[2] - y[2]) * (x[2] - y[2]);
}

// How far, in radians or so, the rotation is from those that the order's own channels can express.
double residual(const EulerOrder& order, const Eigen::Quaterniond& q) {
  const std::array<double, 3> v = {q.x(), q.y(), q.z()};
  const double qi = v[static_cast<std::size_t>(order.axes[0])];
  const double qj = v[static_cast<std::size_t>(order.axes[1])];
  const double qk = v[static_cast<std::size_t>(order.axes[2])];
  if (order.given == 3) return 0;
  if (order.given == 2) return 2 * std::abs(order.parity() * q.w() * qk - qi * qj);
  if (order.given == 1) return 2 * std::hypot(qj, qk);
  return 2 * q.vec().norm();
}

// Angles within the order's own channels: the missing ones are zero.
EulerAngles reduced_angles(const EulerOrder& order, const Eigen::Quaterniond& q, const EulerAngles& near) {
  if (order.given == 0) return {};
  const std::array<double, 3> v = {q.x(), q.y(), q.z()};
  const double qi = v[static_cast<std::size_t>(order.axes[0])];
  if (order.given == 1) return {nearest_turn(2 * std::atan2(qi, q.w()) * degrees_per_radian, near[0]), 0, 0};
  // [w q_j; q_i q_k'] = [cos a; sin a] [cos b sin b] in half angles: take a from the longer column, b from the longer
  // row.
  const double qj = v[static_cast<std::size_t>(order.axes[1])];
  const double qk = order.parity() * v[static_cast<std::size_t>(order.axes[2])];
  const bool first_column = q.w() * q.w() + qi * qi >= qj * qj + qk * qk;
  const double a = first_column ? std::atan2(qi, q.w()) : std::atan2(qk, qj);
  const double b = std::atan2(qj * std::cos(a) + qk * std::sin(a), q.w() * std::cos(a) + qi * std::sin(a));
  const EulerAngles one = {2 * a * degrees_per_radian, 2 * b * degrees_per_radian, 0};
  return {nearest_turn(one[0], near[0]), nearest_turn(one[1], near[1]), 0};
}

bool needs_all_positions(const Clip& clip, int joint) {
  const Joint& j = clip.skeleton.joints[static_cast<std::size_t>(joint)];
  const Clip::TranslationTrack* track = clip.translation_track(joint);
  if (!j.has_position()) return track != nullptr;
  for (const Channel c : {Channel::x_position, Channel::y_position, Channel::z_position}) {
    if (std::ranges::find(j.channels, c) != j.channels.end()) continue;
    const int axis = axis_of(c);
    const auto off_zero = [axis](const Eigen::Vector3d& t) { return t[axis] != 0; };
    if (track != nullptr ? std::ranges::any_of(track->values, off_zero) : off_zero(j.offset)) return true;
  }
  return false;
}

bool needs_all_rotations(const Clip& clip, int joint, const EulerOrder& order) {
  if (order.given == 3) return false;
  for (int f = 0; f < clip.frames; ++f) {
    if (residual(order, clip.rotation(joint, f)) > 1e-7) return true;
  }
  return false;
}

void append_missing(std::vector<Channel>& channels, std::span<const Channel> wanted) {
  for (const Channel c : wanted) {
    if (std::ranges::find(channels, c) == channels.end()) channels.push_back(c);
  }
}

}  // namespace

EulerOrder euler_order(std::span<const Channel> channels) {
  EulerOrder order{.axes = {-1, -1, -1}, .given = 0};
  const auto has = [&](int axis) { return std::ranges::find(order.axes, axis) != order.axes.end(); };
  for (const Channel c : channels) {
    if (!is_position(c) && !has(axis_of(c)) && order.given < 3) {
      order.axes[static_cast<std::size_t>(order.given++)] = axis_of(c);
    }
  }
  for (int axis = 0, at = order.given; axis < 3 && at < 3; ++axis) {
    if (!has(axis)) order.axes[static_cast<std::size_t>(at++)] = axis;
  }
  return order;
}

void quaternions_from_euler(const EulerOrder& order, const double* a, const double* b, const double* c, int count,
                            double* wxyz) {
  HalfAngles ha{}, hb{}, hc{};
  for (int first = 0; first < count; first += block) {
    const int some = std::min(block, count - first);
    half_angle_sincos(a + first, some, ha.sine.data(), ha.cosine.data());
    half_angle_sincos(b + first, some, hb.sine.data(), hb.cosine.data());
    half_angle_sincos(c + first, some, hc.sine.data(), hc.cosine.data());
    multiply(order, ha, hb, hc, some, wxyz + 4 * static_cast<std::ptrdiff_t>(first));
  }
}

EulerAngles euler_angles(const EulerOrder& order, const Eigen::Quaterniond& q) {
  return nearest_turns(angles_keeping_a(decompose(order, q), 0), {0, 0, 0});
}

EulerAngles euler_angles(const EulerOrder& order, const Eigen::Quaterniond& q, const EulerAngles& near) {
  const Decomposed d = decompose(order, q);
  const EulerAngles one = nearest_turns(angles_keeping_a(d, near[0] / degrees_per_radian), near);
  if (d.difference_weight < lock || d.sum_weight < lock) return one;
  const EulerAngles other = nearest_turns({one[0] + 180, 180 - one[1], one[2] + 180}, near);
  return squared_distance(one, near) <= squared_distance(other, near) ? one : other;
}

std::vector<Channel> channels_to_write(const Clip& clip, int joint) {
  const Joint& j = clip.skeleton.joints[static_cast<std::size_t>(joint)];
  std::vector<Channel> out = j.channels;
  if (needs_all_positions(clip, joint)) {
    std::vector<Channel> positions = {Channel::x_position, Channel::y_position, Channel::z_position};
    if (j.has_position()) {
      append_missing(out, positions);
    } else {
      out.insert(out.begin(), positions.begin(), positions.end());
    }
  }
  if (const EulerOrder order = euler_order(j.channels); needs_all_rotations(clip, joint, order)) {
    constexpr std::array<Channel, 3> usual = {Channel::z_rotation, Channel::x_rotation, Channel::y_rotation};
    append_missing(out, usual);
  }
  return out;
}

void euler_columns(const Clip& clip, int joint, const EulerOrder& order, int first, int count, double* columns,
                   int stride, EulerAngles& near, bool has_near) {
  for (int f = 0; f < count; ++f) {
    const Eigen::Quaterniond q = clip.rotation(joint, first + f);
    if (order.given < 3) {
      near = reduced_angles(order, q, has_near ? near : EulerAngles{});
    } else {
      near = has_near ? euler_angles(order, q, near) : euler_angles(order, q);
    }
    has_near = true;
    for (int c = 0; c < order.given; ++c) columns[c * stride + f] = near[static_cast<std::size_t>(c)];
  }
}

}  // namespace kinespace
