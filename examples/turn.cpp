#include <cmath>

#include "examples/performance.h"
#include "examples/posture.h"
#include "examples/sample_motions.h"
#include "kinespace/base/error.h"

namespace kinespace {
namespace {

using namespace samples;
using Eigen::Vector2d;

constexpr double standing_s = 0.4;

// The foot of the turn's side opens, the other closes, as often as needed.
class TurnPlan {
 public:
  TurnPlan(const TurnOptions& options, const Build& build)
      : build_(build),
        heading_(options.take.heading_deg * degree),
        angle_((options.side == Side::left ? 1 : -1) * options.angle_deg * degree),
        step_s_(options.step_s),
        pairs_(static_cast<int>(std::ceil(options.angle_deg / 75))),
        leading_(options.side == Side::left ? 0 : 1) {}

  [[nodiscard]] double steps_end() const { return standing_s + 2 * pairs_ * step_s_; }
  [[nodiscard]] double duration_s() const { return steps_end() + standing_s; }

  [[nodiscard]] FootTrack foot(int side) const {
    std::vector<Plant> plants;
    for (int k = 0; k <= pairs_; ++k) {
      Plant plant = standing_plant(build_, Vector2d::Zero(), heading_ + angle_ * k / pairs_, side);
      const double off = lift_time(side, k);
      plant.strike = k == 0 ? 0 : lift_time(side, k - 1) + 0.72 * step_s_;
      plant.flat = plant.strike + (k == 0 ? 0 : 0.22 * step_s_);
      plant.heel_off = off - 0.26 * step_s_;
      plant.toe_off = off;
      plant.strike_pitch = k == 0 ? 0 : 8 * degree;
      plant.swing = {.lift = 4,
                     .rise = 3,
                     .fall = 3,
                     .in = 0.5,
                     .out = 0.5,
                     .peak_pitch = 26 * degree,
                     .peak_after = 0.15,
                     .pitch_ready = 1,
                     .flight = 0};
      plants.push_back(plant);
    }
    return {build_.foot, std::move(plants)};
  }

  // Of the body: it starts before the first foot is off and ends after the last one stands.
  [[nodiscard]] double heading_at(double t) const {
    const double start = standing_s - 0.3 * step_s_;
    return heading_ + angle_ * travel((t - start) / (steps_end() - start), 0.35, 0.35);
  }

  // The share of the weight on the left foot.
  [[nodiscard]] double weight_left(double t) const {
    std::vector<Keys::Key> keys{{standing_s - 0.5 * step_s_, 0.5}};
    for (int i = 0; i < 2 * pairs_; ++i) {
      const bool left_swings = (i % 2 == 0) == (leading_ == 0);
      keys.push_back({standing_s + (i + 0.4) * step_s_, left_swings ? 0.2 : 0.8});
    }
    keys.push_back({steps_end() + 0.35 * step_s_, 0.5});
    return Keys(keys)(t);
  }

 private:
  [[nodiscard]] double lift_time(int side, int k) const {
    return standing_s + (2 * k + (side == leading_ ? 0 : 1)) * step_s_;
  }

  Build build_;
  double heading_;
  double angle_;
  double step_s_;
  int pairs_;
  int leading_;
};

}  // namespace

void TurnOptions::validate() const {
  take.validate();
  if (side == Side::both) {
    throw Error(ErrorKind::usage,
                {.file = {}, .line = 0, .found = "side = both", .expected = "left or right", .remedy = {}});
  }
  require_range("angle_deg", angle_deg, 15, 360);
  require_range("step_s", step_s, 0.35, 1.5);
}

SampleMotion make_turn(const TurnOptions& options) {
  options.validate();
  const samples::Build build(sample_skeleton(options.take.height_cm));
  const TurnPlan plan(options, build);
  Performance act(options.take, plan.duration_s());
  Random random(salted(options.take.seed, "turn"));
  const Stance stance(random, 0.5 * options.take.variation);
  const Liveliness lively(random, options.take.variation);
  act.feet = {plan.foot(0), plan.foot(1)};
  act.body = [=, feet = act.feet](double t) {
    const auto middle = [&](std::size_t side) {  // the ankle, in the plane
      const Eigen::Vector3d ankle = feet[side].at(t).ankle(build.foot);
      return Vector2d(ankle.x(), ankle.z());
    };
    const double heading = plan.heading_at(t);
    const double left = plan.weight_left(t);
    const Vector2d over = left * middle(0) + (1 - left) * middle(1) + 0.012 * build.standing * forwards(heading);
    BodyPose pose = lively(t, stance(t, over, heading));
    const double ahead = plan.heading_at(t + 0.25) - heading;  // head and chest lead the turn
    pose.spine.yaw += 0.35 * ahead;
    pose.head.yaw += 0.5 * ahead;
    return pose;
  };
  act.stand_tall(0.985, 0.12);
  const std::string style(to_string(options.side));
  return act.perform("turn_" + style, {"turn", style});
}

}  // namespace kinespace
