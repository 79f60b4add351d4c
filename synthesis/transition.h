// The transition itself (yoo2019, section 6.2): one motion, then over an overlap into the next, and so on.
//
// Before an overlap the first motion is played as it is, after it the second. Within it both are played at once, the
// first u times as fast as the second; the speed goes smoothly from that at which the first has its own speed to that
// at which the second has. The second motion is placed in the world by the rigid motion in the ground plane that brings
// its joints nearest to those of the first over the overlap (closed form: kovar 2002, "Motion graphs"), and poses are
// blended with a weight that is twice continuously differentiable: joints on the shortest arc, the root's position
// straight.
//
// How long the overlap lasts: the shortest for which the joints move neither faster nor more suddenly than in the
// motions themselves (seam.h), among the best connections of at least 0.3, 0.5, 0.8, 1.2 and 1.6 s and of the whole
// window, if need be played slower; when none is that smooth, the smoothest.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "kinespace/motion/clip.h"
#include "kinespace/motion/curves.h"
#include "kinespace/synthesis/connection.h"
#include "kinespace/synthesis/seam.h"

namespace kinespace {

struct TransitionOptions {
  double largest_ratio = 1.01;  // > 0; a seam this smooth is not made longer for more ...
  double largest_sink_cm = 3;   // > 0; ... where no joint goes deeper than this below those of both motions around it
  bool fixed = false;           // take the best connection of eq. 15 whatever its seam

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

// How two motions are joined.
struct Join {
  Connection connection;
  GroundMotion placement;  // of the second, from its own frame (ClipCurves) into the first's
  double duration_s = 0;   // of the overlap, by the output's clock
  double stretch = 1;      // the overlap is played so much slower than the motions alone would have it
  SeamRatios ratios;
  double sink_cm = 0;  // how far the lowest joint in the overlap is below the lowest of 0.25 s before and after it
};

struct Transition {
  Clip clip;                  // on the first clip's skeleton, at its rate and place
  std::vector<Join> joins;    // one between each two
  std::vector<double> begin;  // of each overlap, seconds of the output
};

// The rigid motion in the ground plane that takes `second` at the times `second_s` nearest to `first` at `first_s`: the
// mean squared distance of all joints, both on `skeleton`, is least.
[[nodiscard]] GroundMotion ground_alignment(const CurveSampler& first, std::span<const double> first_s,
                                            const CurveSampler& second, std::span<const double> second_s,
                                            const Skeleton& skeleton);

// Joins clips in their order. Curves must be on the space's side (LibraryView gives them so). Throws Error{usage} for
// fewer than two clips and Error{bad_input} naming a clip that is too short to be left or entered.
[[nodiscard]] Transition make_transition(const ConnectionSpace& space, std::span<const ClipCurves> clips,
                                         const Skeleton& skeleton, const TransitionOptions& options = {});

}  // namespace kinespace
