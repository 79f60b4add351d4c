// When which joint of a foot stands: contacts.
//
// A contact is a time in which an ankle or a toe joint keeps its place on the ground. A step that rolls over the ball
// of the foot has two that overlap: the ankle's while the foot is flat, the toe's until it leaves. In a clip with foot
// skate the joint slides during the contact; that is what cleanup takes out.
//
// Where contacts are found, two ways (contacts_by_rule here, ContactModel in footskate/contact_model.h); both end by
// `fit_ends`, which moves each end to the frame where the joint leaves its place.
#pragma once

#include <vector>

#include "kinespace/footskate/foot_tracks.h"
#include "kinespace/footskate/ground.h"

namespace kinespace {

struct FootContact {
  int slot = 0;  // of Feet::foot_joints: 0 left ankle, 1 left toe, 2 right ankle, 3 right toe
  int first_frame = 0;
  int last_frame = 0;  // included
  bool operator==(const FootContact&) const = default;
};

// By slot, then by time; contacts of one slot do not touch.
using FootContacts = std::vector<FootContact>;

// The rule of height and speed: every rest that bears the body (footskate/ground.h, bearing_rests), its ends fitted.
[[nodiscard]] FootContacts contacts_by_rule(const FootTracks& tracks, const Ground& ground);

// Moves the ends of contacts to where the joint leaves its place: a line (a constant for the height) is fitted to the
// stillest 0.2 s on this side of the middle, and the contact reaches as far as the joint keeps to it. How near it must
// keep is 4 times what it strays there, at least 0.00004 and at most 0.004 leg lengths, and along the ground 15 % of
// the way it has slid since and 20 % of the root's; or it must be slower than 0.005 leg lengths a second. An end moves
// out by 0.1 s at most. Contacts under 50 ms are dropped; those of a slot with less than 80 ms between them, in which
// the joint stays within 1.2 % of the leg length, are joined.
[[nodiscard]] FootContacts fit_ends(const FootTracks& tracks, const FootContacts& contacts);

// Whether each frame of a slot is in one of the contacts.
[[nodiscard]] std::vector<char> planted_frames(const FootContacts& contacts, int slot, int frames);

// The runs of set frames as contacts of the slot.
void append_runs(const std::vector<char>& planted, int slot, FootContacts& out);

}  // namespace kinespace
