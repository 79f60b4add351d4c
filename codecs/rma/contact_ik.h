// Postures that keep to contacts: inverse kinematics by the Jacobian (lin2011, sections 5.3 and 5.5).
//
// In every frame of a contact the joints above the touching one turn until it is where the contact has it: by damped
// least squares,
//
//   w_i = r_i x y,   y = (J J' + 4 cm^2 + |e|^2)^-1 e,   J J' = sum_i |r_i|^2 - r_i r_i'      e: what is missing, cm
//
// w_i being the turn of joint i, at r_i from the touching joint. Two joints above it turn (knee and hip for an ankle),
// and one more for each of its parents that has contacts of its own (the ankle for a toe). A toe comes first and takes
// the leg along, then the ankle is put in its own place, then the foot turns about it to the toe's. The root never
// moves.
//
// Before and after a contact its correction fades out, within the paper's 30 ms or longer. A contact out of reach is
// come as near to as the limb can. Sums, products and square roots in a fixed order: the same bits on every machine.
#pragma once

#include <span>

#include "kinespace/codecs/rma/contact_trajectories.h"
#include "kinespace/motion/clip.h"

namespace kinespace {

// The tracks are sorted by joint, then by time, as contact_tracks gives them.
void hold_contacts(Clip& clip, std::span<const ContactTrack> tracks, double blending_s = 0.03);

}  // namespace kinespace
