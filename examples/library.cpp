#include <functional>
#include <map>

#include <fmt/format.h>

#include "examples/performance.h"
#include "examples/sample_motions.h"

namespace kinespace {
namespace {

using samples::Random;

// One entry of the collection: a take of it from the common options and chance.
using Maker = std::function<SampleMotion(const TakeOptions&, Random&)>;

Maker walk(std::string style, double speed, double turn_rate) {
  return [=](const TakeOptions& take, Random& random) {
    return make_walk({.speed_m_s = speed * random.between(0.94, 1.06),
                      .turn_rate_deg_s = turn_rate * random.between(0.85, 1.15),
                      .start_phase = random.between(0, 1),
                      .duration_s = random.between(2.4, 3.4),
                      .style = style,
                      .take = take});
  };
}

Maker run(std::string style, double speed, double turn_rate) {
  return [=](const TakeOptions& take, Random& random) {
    return make_run({.speed_m_s = speed * random.between(0.95, 1.05),
                     .turn_rate_deg_s = turn_rate * random.between(0.85, 1.15),
                     .start_phase = random.between(0, 1),
                     .duration_s = random.between(1.6, 2.4),
                     .style = style,
                     .take = take});
  };
}

Maker turn(Side side, double angle) {
  return [=](const TakeOptions& take, Random& random) {
    return make_turn({.side = side,
                      .angle_deg = angle * random.between(0.93, 1.07),
                      .step_s = random.between(0.44, 0.6),
                      .take = take});
  };
}

Maker wave(Side side) {
  return [=](const TakeOptions& take, Random& random) {
    return make_wave({.side = side,
                      .frequency_hz = random.between(1.3, 2),
                      .waves = 2 + static_cast<int>(random.between(0, 2.99)),
                      .take = take});
  };
}

Maker raise(Side side) {
  return [=](const TakeOptions& take, Random& random) {
    return make_raise({.side = side,
                       .angle_deg = random.between(140, 172),
                       .raise_s = random.between(0.75, 1.1),
                       .hold_s = random.between(0.2, 0.8),
                       .take = take});
  };
}

Maker jump(double rise, double distance) {
  return [=](const TakeOptions& take, Random& random) {
    return make_jump({.rise_cm = rise * random.between(0.85, 1.15),
                      .distance_m = distance * random.between(0.85, 1.15),
                      .take = take});
  };
}

Maker stand(std::string style, double sway) {
  return [=](const TakeOptions& take, Random& random) {
    return make_stand({.duration_s = random.between(2, 3.2), .style = style, .sway = sway, .take = take});
  };
}

std::vector<Maker> collection() {
  return {walk("slow", 0.8, 0),   walk("normal", 1.3, 0),  walk("fast", 1.8, 0),
          walk("left", 1.2, 35),  walk("right", 1.2, -35), run("slow", 2.3, 0),
          run("normal", 3, 0),    run("fast", 3.9, 0),     run("left", 2.7, 30),
          run("right", 2.7, -30), turn(Side::left, 90),    turn(Side::right, 90),
          turn(Side::left, 180),  turn(Side::right, 180),  wave(Side::left),
          wave(Side::right),      wave(Side::both),        raise(Side::left),
          raise(Side::right),     raise(Side::both),       jump(30, 0),
          jump(25, 0.6),          stand("calm", 1),        stand("restless", 2)};
}

}  // namespace

void LibraryOptions::validate() const {
  samples::require_range("takes", takes, 1, 1000);
  TakeOptions{.rate_hz = rate_hz, .height_cm = height_cm}.validate();
}

std::vector<SampleMotion> sample_library(const LibraryOptions& options) {
  options.validate();
  std::vector<SampleMotion> out;
  Random random(samples::salted(options.seed, "library"));
  std::map<std::string, int> numbers;
  for (const Maker& make : collection()) {
    for (int i = 0; i < options.takes; ++i) {
      const TakeOptions take{.rate_hz = options.rate_hz,
                             .height_cm = options.height_cm,
                             .heading_deg = random.between(-180, 180),
                             .seed = random.next(),
                             .variation = 1};
      SampleMotion motion = make(take, random);
      motion.clip.name += fmt::format("_{:03}", ++numbers[motion.clip.name]);
      out.push_back(std::move(motion));
    }
  }
  return out;
}

void TakeOptions::validate() const {
  samples::require_range("rate_hz", rate_hz, 10, 1000);
  samples::require_range("height_cm", height_cm, 100, 220);
  samples::require_range("heading_deg", heading_deg, -360, 360);
  samples::require_range("variation", variation, 0, 1);
}

}  // namespace kinespace
