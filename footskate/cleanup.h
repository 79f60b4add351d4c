// Foot-skate cleanup: feet that stand stay where they stand.
//
// After kovar 2002 ("Footskate Cleanup for Motion Capture Editing") and yoo2019, section 6.3:
//   1. the contacts (footskate/contact_model.h), or those given;
//   2. every plant gets one place (footskate/plants.h);
//   3. the root path moves smoothly so that every planted leg reaches (footskate/detail/root_path.h);
//   4. between plants a foot carries the change of both over, twice continuously differentiable, so that nothing pops,
//      and is kept on or above the ground;
//   5. two-bone inverse kinematics (footskate/two_bone_ik.h); feet keep their orientation in the world, but for the
//      small turn that lets ankle and toe both stand.
// Everything above the hips keeps its pose. Cleaning what was cleaned changes no joint by more than 0.1 cm: the passes
// are repeated until that is so, at most `passes` times.
//
// What it does not do: plant hands, move feet onto objects, mend contacts that no one found.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kinespace/footskate/plants.h"
#include "kinespace/footskate/skate_measures.h"

namespace kinespace {

class ContactModel;

struct CleanOptions {
  FeetNames feet;                        // none: looked for
  std::optional<double> floor_cm;        // the ground is flat at this height, -1e5 to 1e5; none: estimated
  std::optional<FootContacts> contacts;  // these and no others; none: detected
  const ContactModel* model = nullptr;   // detects them; null: the model that comes with the library
  int passes = 12;                       // 1 to 20
  void validate() const;                 // throws Error{usage} naming field, value and range
};

struct CleanReport {
  Feet feet;
  Ground ground;
  std::vector<Plant> plants;                     // those of the last pass that changed something
  std::optional<double> foot_slide_before_cm_s;  // over the contacts found in the input; nullopt: there are none
  std::optional<double> foot_slide_after_cm_s;   // over the same frames
  double floor_penetration_cm =
      0;  // after: the deepest joint; uneven ground: below the lower of its plants before and after
  FootMotion feet_before, feet_after;  // by geometry alone, over the ground and the standing heights of the input
  double mean_pose_change_cm = 0;      // footskate/skate_measures.h
  double largest_move_cm = 0;          // of any joint, world
  double acceleration_ratio = 1;       // the largest of any joint, after over before; 1 where nothing moves
  int passes = 0;
};

struct CleanResult {
  Clip clip;
  CleanReport report;
};

// What a user should know before believing the result, a sentence each: that no foot was found to stand, so that
// nothing was cleaned and nothing is known of what slides; that feet slide more than before, those that were planted or by geometry alone; that a joint is jerked
// more than half as much again. Empty when all is well.
[[nodiscard]] std::vector<std::string> doubts_about(const CleanReport& report);

// Throws Error{bad_input} when no feet are found or a given contact is outside the clip.
[[nodiscard]] CleanResult clean(Clip clip, const CleanOptions& options = {});

}  // namespace kinespace
