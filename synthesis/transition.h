// The transition itself (yoo2019, section 6.2): one motion, then over an overlap into the next, and so on.
//
// Before an overlap the first motion is played as it is, after it the second. Within it both are played at once, the
// first u times as fast as the second; the speed goes smoothly from that at which the first has its own speed to that
// at which the second has. The second motion is placed in the world by the rigid motion in the ground plane that brings
// its joints nearest to those of the first over the overlap (closed form: kovar 2002, "Motion graphs"), and poses are
// blended with a weight that is twice continuously differentiable: joints on the shortest arc, the root's position
// straight.
//
// Or, where that is better, the second motion is played from the seam on and what the first differed from it dies away
// (inertialization: Bollo 2018, "Inertialization: High-Performance Animation Transitions in Gears of War").
//
// Feet: which foot stands when and where is planned over the overlap from what both motions' feet do
// (detail/footsteps.h): one that stands in both keeps its place where places are near, else it makes a step; the legs
// and the root follow the feet.
//
// Which join: of those that eq. 15 gives with overlaps of at least 0.3, 0.5, 0.8, 1.2 and 1.6 s and the whole window, at
// near the motions' own speeds, joined in both ways, the one whose result is best as measured: how much faster and more
// suddenly joints and root move than in the motions themselves (seam.h), how much more feet slide
// (footskate/skate_measures.h), how deep they go, and how far from their own speed the motions are played.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/footskate/contacts.h"
#include "kinespace/footskate/skate_measures.h"
#include "kinespace/motion/clip.h"
#include "kinespace/motion/curves.h"
#include "kinespace/synthesis/connection.h"
#include "kinespace/synthesis/seam.h"

namespace kinespace {

enum class JoinWay : std::uint8_t { blend, inertialization };

// "blend", "inertialization".
[[nodiscard]] std::string_view to_string(JoinWay way);

struct TransitionOptions {
  double largest_speed = 1.25;  // 1 to 2: one motion is played at most so much faster than the other in the overlap
  bool plan_feet = true;        // where the skeleton has feet
  std::optional<JoinWay> way;   // this one only

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

// How two motions are joined.
struct Join {
  Connection connection;
  JoinWay way = JoinWay::blend;
  GroundMotion placement;  // of the second, from its own frame (ClipCurves) into the first's
  double duration_s = 0;   // of the overlap, by the output's clock
  double stretch = 1;      // the overlap is played so much slower than the motions alone would have it
  double pace = 1;         // steps of feet that have to go last so much longer than they usually do
  SeamRatios ratios;
  // Feet over the overlap, and over both motions alone (the mean); nullopt where no legs can be told.
  std::optional<FootMotion> feet, feet_of_sources;
  bool feet_planned = false;
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

// Plays the clips joined as said, one join between each two: what make_transition does once it has chosen. Of a join its
// connection, way, placement, duration, pace and feet_planned are looked at.
[[nodiscard]] Transition play_joins(std::span<const ClipCurves> clips, std::span<const Join> joins,
                                    const Skeleton& skeleton,
                                    std::span<const std::optional<FootContacts>> contacts = {});

// Joins clips in their order. Curves must be on the space's side (LibraryView gives them so). `contacts` are when the feet
// of each clip stand, where that is known (KeptFeet::frames); else they are found (footskate/contact_model.h). Throws Error{usage} for
// fewer than two clips and Error{bad_input} naming a clip that is too short to be left or entered.
[[nodiscard]] Transition make_transition(const ConnectionSpace& space, std::span<const ClipCurves> clips,
                                         const Skeleton& skeleton, const TransitionOptions& options = {},
                                         std::span<const std::optional<FootContacts>> contacts = {});

}  // namespace kinespace
