// From a plan (two foot tracks, and the body as a function of time) to a clip with its contacts.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "examples/body.h"
#include "examples/sample_motions.h"
#include "examples/smooth.h"

namespace kinespace::samples {

// Shares of a leg's length. A knee that passes the straight leg at speed would snap, so striding stays further from it.
inline constexpr double comfortable_reach = 0.993;  // standing
inline constexpr double longest_reach = 0.988;      // striding

struct Performance {
  Performance(const TakeOptions& take, double duration_s);

  TakeOptions take;
  double duration_s;
  Skeleton skeleton;
  Build build;
  std::vector<FootTrack> feet;           // left, right
  std::function<BodyPose(double)> body;  // everything but the feet; hips.y may leave out a constant

  [[nodiscard]] BodyPose pose(double t) const;
  // What can be added to hips.y at most so that no leg reaches further than `reach` at any time in [first, last].
  [[nodiscard]] double room_above(double first, double last, double reach) const;
  // Sets hips.y to the highest smooth function that keeps both legs within `reach`, looking `window_s` to both sides.
  void stand_tall(double reach, double window_s);
  // Adds a constant to hips.y.
  void lift_hips(double by_cm);
  [[nodiscard]] SampleMotion perform(std::string name, std::vector<std::string> labels) const;
};

// The plant of a foot beside the middle of a standing body: where both feet stand before and after a motion.
[[nodiscard]] Plant standing_plant(const Build& build, const Eigen::Vector2d& middle, double heading, int side);
// Both feet standing there for ever.
[[nodiscard]] std::vector<FootTrack> standing_feet(const Build& build, double heading);

// A seed for one purpose: clips that differ in `salt` only vary independently.
[[nodiscard]] std::uint64_t salted(std::uint64_t seed, std::string_view salt);

// Throws Error{usage} "field = value, expected low to high" unless low <= value <= high.
void require_range(std::string_view field, double value, double low, double high);

// Throws Error{usage} unless it can be the middle of a clip's name: 1 to 40 letters, digits and hyphens.
void require_style(std::string_view style);

}  // namespace kinespace::samples
