#include "kinespace/footskate/contacts.h"

#include <algorithm>
#include <cmath>

namespace kinespace {
FootContacts contacts_by_rule(const FootTracks& tracks, const Ground& ground) {
  FootContacts out;
  for (const Rest& r : bearing_rests(tracks, ground)) out.push_back({r.slot, r.first_frame, r.last_frame});
  return fit_ends(tracks, out);
}

std::vector<char> planted_frames(const FootContacts& contacts, int slot, int frames) {
  std::vector<char> out(frames, 0);
  for (const FootContact& c : contacts) {
    if (c.slot == slot) std::fill(out.begin() + c.first_frame, out.begin() + c.last_frame + 1, 1);
  }
  return out;
}

void append_runs(const std::vector<char>& planted, int slot, FootContacts& out) {
  const int frames = static_cast<int>(planted.size());
  for (int f = 0; f < frames; ++f) {
    if (planted[f] == 0) continue;
    const int first = f;
    while (f + 1 < frames && planted[f + 1] != 0) ++f;
    out.push_back({slot, first, f});
  }
}

}  // namespace kinespace
