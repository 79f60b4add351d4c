#include "examples/gait.h"

#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace::samples {

using Eigen::Vector2d;

Vector2d Path::point(double t) const {
  // The chord of the arc: its length is speed * t * sinc(angle / 2), its direction the heading at half the way.
  const double half = turn_rate * t / 2;
  const double sinc = std::abs(half) < 1e-6 ? 1 - half * half / 6 : std::sin(half) / half;
  return speed * t * sinc * forwards(heading + half);
}

Vector2d Path::beside(double t, double ahead, double side) const {
  const double later = t + ahead / speed;
  return point(later) + side * leftwards(heading_at(later));
}

double Path::bank() const {
  return std::atan(speed * turn_rate / gravity);
}

std::vector<FootTrack> plan_steps(const Gait& gait, const Build& build, double duration_s, Random& random,
                                  double variation) {
  // Leaning into a turn, the hips are further inside than the feet.
  const double inside = std::tan(gait.path.bank()) * build.standing;
  std::vector<FootTrack> feet;
  for (int side = 0; side < 2; ++side) {
    const double outwards = side == 0 ? 1 : -1;
    const double first_strike = (-gait.phase + (side == 0 ? 0 : 0.5) - 2) * gait.stride_s;
    const int count = static_cast<int>(std::ceil((duration_s - first_strike) / gait.stride_s)) + 2;
    std::vector<Plant> plants;
    for (int i = 0; i < count; ++i) {
      const double strike = first_strike + i * gait.stride_s;
      const double over = strike + gait.under * gait.stride_s;
      Plant plant;
      const double turned = variation * random.between(-1.5, 1.5) * degree;
      const double ahead = variation * random.between(-1, 1);
      const double aside = variation * random.between(-0.7, 0.7);
      plant.yaw = gait.path.heading_at(over) + outwards * gait.toe_out + turned;
      plant.toe = gait.path.beside(over, ahead, outwards * gait.half_width - inside + aside) +
                  build.foot.ankle_to_toe * forwards(plant.yaw);
      plant.strike = strike;
      plant.flat = strike + gait.flat * gait.stride_s;
      plant.heel_off = strike + gait.heel_off * gait.stride_s;
      plant.toe_off = strike + gait.toe_off * gait.stride_s;
      plant.strike_pitch = gait.strike_pitch;
      plant.swing = gait.swing;
      plant.swing.lift *= 1 + variation * random.between(-0.1, 0.1);
      plants.push_back(plant);
    }
    feet.emplace_back(build.foot, std::move(plants));
  }
  return feet;
}

void require_step(double step_m, double longest_m) {
  if (step_m <= longest_m) return;
  throw Error(ErrorKind::usage, {.file = {},
                                 .line = 0,
                                 .found = fmt::format("steps of {:.2f} m", step_m),
                                 .expected = fmt::format("at most {:.2f} m", longest_m),
                                 .remedy = "raise cadence_per_min or lower speed_m_s"});
}

}  // namespace kinespace::samples
