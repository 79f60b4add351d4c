#include "kinespace/mesh_codecs/rigid_track.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "kinespace/base/error.h"
#include "kinespace/entropy/integer_coder.h"

namespace kinespace {
namespace {

constexpr double turn_step = 1.0 / 16384;
constexpr double shift_step = 1.0 / 32768;
constexpr std::int64_t most_rigid_steps = std::int64_t{1} << 30;

std::int64_t expected(std::span<const std::array<std::int32_t, 6>> steps, std::size_t f, std::size_t i) {
  if (f == 0) return 0;
  if (f == 1) return steps[0][i];
  return 2 * std::int64_t{steps[f - 1][i]} - steps[f - 2][i];
}

// By how far off the expectation was the last time.
int context(std::int64_t last_miss, std::size_t i) {
  const int size = bit_length(static_cast<std::uint64_t>(std::abs(last_miss)));
  return (i < 3 ? 0 : 8) + std::min(size / 2, 7);
}

}  // namespace

RigidMotion RigidTrack::motion(std::size_t frame) const {
  const auto& s = steps[frame];
  RigidMotion out;
  out.rotation = rotation_of(Eigen::Vector3d(s[0] * turn_step, s[1] * turn_step, s[2] * turn_step));
  const double step = size * shift_step;
  out.translation = Eigen::Vector3d(s[3] * step, s[4] * step, s[5] * step);
  return out;
}

RigidTrack quantised(std::span<const RigidMotion> motions, double size) {
  RigidTrack out{.steps = {}, .size = size};
  const double step = size * shift_step;
  for (const RigidMotion& motion : motions) {
    const Eigen::Vector3d turn = rotation_numbers(motion.rotation);
    auto& s = out.steps.emplace_back();
    for (int d = 0; d < 3; ++d) {
      s[static_cast<std::size_t>(d)] = static_cast<std::int32_t>(std::lround(turn[d] / turn_step));
      const double shift = step > 0 ? motion.translation[d] / step : 0;
      if (!(std::abs(shift) < static_cast<double>(most_rigid_steps))) {
        throw Error(ErrorKind::bad_input, {.found = "a mesh that travels more than 32768 times its size",
                                           .expected = "a mesh that stays nearer"});
      }
      s[static_cast<std::size_t>(d) + 3] = static_cast<std::int32_t>(std::lround(shift));
    }
  }
  return out;
}

Bytes pack_track(const RigidTrack& track) {
  IntegerWriter out;
  std::array<std::int64_t, 6> miss{};
  for (std::size_t f = 0; f < track.steps.size(); ++f) {
    for (std::size_t i = 0; i < 6; ++i) {
      const std::int64_t off = track.steps[f][i] - expected(track.steps, f, i);
      out.put(off, context(miss[i], i));
      miss[i] = off;
    }
  }
  return std::move(out).finish();
}

RigidTrack unpack_track(std::span<const std::byte> bytes, int frames, double size, const std::string& source) {
  RigidTrack out{.steps = {}, .size = size};
  IntegerReader in(bytes, source);
  std::array<std::int64_t, 6> miss{};
  for (int f = 0; f < frames; ++f) {
    std::array<std::int32_t, 6> s{};
    for (std::size_t i = 0; i < 6; ++i) {
      const std::int64_t off = in.get(context(miss[i], i));
      const std::int64_t at = expected(out.steps, static_cast<std::size_t>(f), i) + off;
      if (at < -most_rigid_steps || at > most_rigid_steps) in.damaged();
      s[i] = static_cast<std::int32_t>(at);
      miss[i] = off;
    }
    out.steps.push_back(s);
  }
  in.expect_end();
  return out;
}

}  // namespace kinespace
