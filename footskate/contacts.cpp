#include "footskate/contacts.h"

#include <algorithm>
#include <cmath>

namespace kinespace {
namespace {

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

// Whether any joint of a leg rests at each frame.
std::vector<char> resting(const std::vector<Rest>& rests, int leg, int frames) {
  std::vector<char> out(frames, 0);
  for (const Rest& r : rests) {
    if (r.slot / 2 == leg) std::fill(out.begin() + r.first_frame, out.begin() + r.last_frame + 1, 1);
  }
  return out;
}

bool bears_alone(const Rest& rest, const std::vector<char>& other_rests) {
  return std::any_of(other_rests.begin() + rest.first_frame, other_rests.begin() + rest.last_frame + 1,
                     [](char rests) { return rests == 0; });
}

}  // namespace

std::array<double, 4> standing_heights(const FootTracks& tracks, const Ground& ground) {
  std::array<double, 4> out{};
  const std::vector<Rest> rests = find_rests(tracks);
  for (int slot = 0; slot < 4; slot += 2) {
    if (!tracks.has(slot + 1)) continue;
    std::vector<double> heights;
    for (const Rest& r : rests) {
      if (r.slot != slot) continue;
      for (int f = r.first_frame; f <= r.last_frame; ++f) {
        const double toe = tracks.at[slot + 1][f].y();
        const double level = ground.kind == GroundKind::uneven ? toe : ground.at(tracks.at[slot][f]);
        heights.push_back(tracks.at[slot][f].y() - level);
      }
    }
    out[slot] = median(std::move(heights));
  }
  return out;
}

FootContacts contacts_by_rule(const FootTracks& tracks, const Ground& ground) {
  const double band = 0.05 * tracks.feet.leg_length_cm;
  const auto stand = standing_heights(tracks, ground);
  const std::vector<Rest> rests = find_rests(tracks);
  const std::array<std::vector<char>, 2> leg_rests = {resting(rests, 0, tracks.frames),
                                                      resting(rests, 1, tracks.frames)};
  FootContacts out;
  for (const Rest& r : rests) {
    const bool on_level = std::abs(r.place.y() - ground.at(r.place) - stand[r.slot]) <= band;
    const bool on_step = ground.kind == GroundKind::uneven && bears_alone(r, leg_rests[1 - r.slot / 2]);
    if (on_level || on_step) out.push_back({r.slot, r.first_frame, r.last_frame});
  }
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
