#include "kinespace/footskate/contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

namespace {

// Where a joint that keeps sliding as it does would be: x and z run on a line, y stays.
struct Slide {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // cm, at `centre`
  Eigen::Vector3d speed = Eigen::Vector3d::Zero();  // cm a frame
  double centre = 0;                                // frame
  double stray = 0;                                 // cm: root mean square of what is left, across
  double bob = 0;                                   // the same up and down

  [[nodiscard]] Eigen::Vector3d at(double frame) const { return place + speed * (frame - centre); }
};

Slide fit_slide(const Path& path, int first, int last) {
  const double count = last - first + 1;
  Slide out{.centre = 0.5 * (first + last)};
  for (int f = first; f <= last; ++f) out.place += path[f] / count;
  double squares = 0;
  for (int f = first; f <= last; ++f) {
    out.speed += (f - out.centre) * (path[f] - out.place);
    squares += (f - out.centre) * (f - out.centre);
  }
  out.speed *= count >= 4 ? 1 / squares : 0;
  out.speed.y() = 0;
  double sum = 0;
  double upright = 0;
  for (int f = first; f <= last; ++f) {
    const Eigen::Vector3d off = path[f] - out.at(f);
    sum += off.x() * off.x() + off.z() * off.z();
    upright += off.y() * off.y();
  }
  out.stray = std::sqrt(sum / count);
  out.bob = std::sqrt(upright / count);
  return out;
}

class EndFitter {
 public:
  EndFitter(const FootTracks& tracks, const FootContact& contact)
      : tracks_(tracks), path_(tracks.at[contact.slot]), contact_(contact) {}

  // The end in the direction `step`, -1 or 1.
  [[nodiscard]] int end(int step) const {
    const Window best = stillest(step);
    const int beyond = static_cast<int>(std::lround(0.1 * tracks_.rate_hz));
    const int limit =
        std::clamp((step > 0 ? contact_.last_frame : contact_.first_frame) + step * beyond, 0, tracks_.frames - 1);
    const int from = step > 0 ? best.last : best.first;
    int f = from;
    while (f != limit && keeps(best.slide, from, f + step)) f += step;
    return f;
  }

 private:
  struct Window {
    int first;
    int last;
    Slide slide;
  };

  // Of windows from the end inwards to the middle of the contact the one in which the joint strays least: near the end
  // it may be leaving already.
  [[nodiscard]] Window stillest(int step) const {
    const int length = contact_.last_frame - contact_.first_frame + 1;
    const int most = std::min(length, std::max(2, length / 2));
    const int span = std::clamp(static_cast<int>(0.2 * tracks_.rate_hz), std::min(2, most), most);
    const int reach = std::min(length - span, std::max(length / 4, static_cast<int>(0.1 * tracks_.rate_hz)));
    Window best{};
    double least = std::numeric_limits<double>::infinity();
    for (int inset = 0; inset <= reach; ++inset) {
      const int first = step > 0 ? contact_.last_frame - inset - span + 1 : contact_.first_frame + inset;
      const Slide slide = fit_slide(path_, first, first + span - 1);
      if (slide.stray + slide.bob >= 0.8 * least) continue;  // clearly stiller than one that is nearer to the end
      least = slide.stray + slide.bob;
      best = {first, first + span - 1, slide};
    }
    return best;
  }

  [[nodiscard]] bool keeps(const Slide& slide, int from, int frame) const {
    const double length = tracks_.feet.leg_length_cm;
    const auto near = [&](double stray) { return std::clamp(4 * stray, 0.00004 * length, 0.004 * length); };
    const Eigen::Vector3d off = path_[frame] - slide.at(frame);
    const Eigen::Vector3d way = tracks_.root[frame] - tracks_.root[from];
    const double slid = 0.15 * slide.speed.norm() * std::abs(frame - from) + 0.2 * std::hypot(way.x(), way.z());
    if (std::abs(off.y()) <= near(slide.bob) && std::hypot(off.x(), off.z()) <= near(slide.stray) + slid) return true;
    return tracks_.velocity(path_, frame).norm() <= 0.005 * length;
  }

  const FootTracks& tracks_;
  const Path& path_;
  FootContact contact_;
};

// Joins contacts with less than 80 ms between them in which the joint hardly leaves its place.
void join_near(const FootTracks& tracks, const Path& path, std::vector<char>& planted) {
  const double near = 0.012 * tracks.feet.leg_length_cm;
  for (int f = 1; f < tracks.frames; ++f) {
    if (planted[f] != 0 || planted[f - 1] == 0) continue;
    int next = f;
    while (next < tracks.frames && planted[next] == 0) ++next;
    if (next == tracks.frames) return;
    bool stays = next - f <= 0.08 * tracks.rate_hz;
    for (int i = f; i <= next; ++i) stays = stays && (path[i] - path[f - 1]).norm() <= near;
    if (stays) std::fill(planted.begin() + f, planted.begin() + next, 1);
    f = next;
  }
}

}  // namespace

FootContacts fit_ends(const FootTracks& tracks, const FootContacts& contacts) {
  FootContacts out;
  for (int slot = 0; slot < 4; ++slot) {
    std::vector<char> planted(tracks.frames, 0);
    for (const FootContact& c : contacts) {
      if (c.slot != slot) continue;
      const EndFitter fitter(tracks, c);
      const int first = fitter.end(-1);
      const int last = fitter.end(1);
      if (last - first < 0.05 * tracks.rate_hz - 1e-9) continue;
      std::fill(planted.begin() + first, planted.begin() + last + 1, 1);
    }
    join_near(tracks, tracks.at[slot], planted);
    append_runs(planted, slot, out);
  }
  return out;
}

}  // namespace kinespace
