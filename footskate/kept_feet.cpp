#include "kinespace/footskate/kept_feet.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "kinespace/footskate/contact_model.h"
#include "kinespace/footskate/detail/leg_pose.h"
#include "kinespace/footskate/skate_measures.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

using Eigen::Vector3d;
using Steps = std::array<std::int64_t, 3>;

constexpr double stray_cm = 0.25;                           // of a contact's places from where the joint was
constexpr double step_cm = 0.05;                            // that places are kept in
constexpr std::int64_t most_steps = std::int64_t{1} << 31;  // 1000 km
constexpr double axis_steps = 127;

// From the world to the clip's frame.
class IntoClip {
 public:
  explicit IntoClip(const Placement& placement)
      : start_(placement.start_cm), turn_(Eigen::AngleAxisd(-placement.heading_rad, Vector3d::UnitY())) {}
  [[nodiscard]] Vector3d place(const Vector3d& world) const { return turn_ * (world - start_); }
  [[nodiscard]] Eigen::Vector2d gradient(const Eigen::Vector2d& world) const {
    const Vector3d turned = turn_ * Vector3d(world.x(), 0, world.y());
    return {turned.x(), turned.z()};
  }

 private:
  Vector3d start_;
  Eigen::Quaterniond turn_;
};

double largest_stray(const Path& path, int first, int last) {
  double largest = 0;
  for (int f = first + 1; f < last; ++f) {
    const double share = static_cast<double>(f - first) / (last - first);
    largest = std::max(largest, (path[f] - (path[first] + share * (path[last] - path[first]))).norm());
  }
  return largest;
}

// The corner after `first`: the farthest of those that doubling and halving find, with all between them near the line.
int next_corner(const Path& path, int first, int last) {
  int good = first + 1;
  int step = 1;
  while (good < last && largest_stray(path, first, std::min(last, good + step)) <= stray_cm) {
    good = std::min(last, good + step);
    step *= 2;
  }
  for (; step > 0; step /= 2) {
    if (good + step <= last && largest_stray(path, first, good + step) <= stray_cm) good += step;
  }
  return good;
}

KeptContact kept(const FootTracks& tracks, const FootContact& contact, const IntoClip& into) {
  const Path& path = tracks.at[contact.slot];
  KeptContact out{.slot = contact.slot, .places = {{contact.first_frame, into.place(path[contact.first_frame])}}};
  for (int f = contact.first_frame; f < contact.last_frame;) {
    f = next_corner(path, f, contact.last_frame);
    out.places.push_back({f, into.place(path[f])});
  }
  return out;
}

Steps steps_of(const Vector3d& place) {
  Steps out{};
  for (int i = 0; i < 3; ++i) {
    out[i] = std::clamp(std::llround(place(i) / step_cm), -static_cast<long long>(most_steps),
                        static_cast<long long>(most_steps));
  }
  return out;
}

void put_joint(ByteWriter& out, int joint) {
  put_varint(out, static_cast<std::uint64_t>(joint + 1));
}

void put_axis(ByteWriter& out, const Vector3d& axis) {
  for (int i = 0; i < 3; ++i) out.put(static_cast<std::int8_t>(std::lround(axis(i) * axis_steps)));
}

Vector3d get_axis(ByteReader& in) {
  Vector3d axis;
  for (int i = 0; i < 3; ++i) axis(i) = in.get<std::int8_t>();
  return axis.norm() > 0 ? axis.normalized() : axis;
}

double get_number(ByteReader& in, const char* what) {
  const auto value = static_cast<double>(in.get<float>());
  if (!std::isfinite(value)) in.fail(fmt::format("a {} that is no number", what), "a finite one");
  return value;
}

int get_joint(ByteReader& in, const Skeleton& skeleton) {
  const std::uint64_t joint = get_varint(in);
  if (joint > static_cast<std::uint64_t>(skeleton.joint_count())) {
    in.fail(fmt::format("joint {} of a leg", joint), fmt::format("at most {}", skeleton.joint_count()));
  }
  return static_cast<int>(joint) - 1;
}

// Whether `joint` is below `above`, with bones that are longer than nothing between.
bool hangs_from(const Skeleton& skeleton, int joint, int above) {
  double length = 0;
  while (joint > above) {
    length += skeleton.joints[joint].offset.norm();
    joint = skeleton.joints[joint].parent;
  }
  return above >= 0 && joint == above && length > 0;
}

Leg get_leg(ByteReader& in, const Skeleton& skeleton) {
  Leg leg;
  for (int* joint : {&leg.hip, &leg.knee, &leg.ankle, &leg.toe}) *joint = get_joint(in, skeleton);
  const int root = skeleton.travel_root();
  const bool leglike = leg.hip > root && hangs_from(skeleton, leg.knee, leg.hip) &&
                       hangs_from(skeleton, leg.ankle, leg.knee) &&
                       (leg.toe < 0 || hangs_from(skeleton, leg.toe, leg.ankle));
  if (!leglike) in.fail("joints that are no leg", "hip, knee, ankle and toe below each other");
  return leg;
}

// What the places before say, for those that follow.
struct Before {
  int frame = 0;
  Steps steps{};
};

void put_place(ByteWriter& out, const KeptPlace& place, Before& before) {
  put_varint(out, static_cast<std::uint64_t>(place.frame - before.frame));
  const Steps steps = steps_of(place.place);
  for (int i = 0; i < 3; ++i) put_signed_varint(out, steps[i] - before.steps[i]);
  before = {place.frame, steps};
}

KeptPlace get_place(ByteReader& in, int frames, Before& before) {
  const std::uint64_t step = get_varint(in);
  if (step >= static_cast<std::uint64_t>(frames - before.frame)) {
    in.fail("a contact beyond the clip's end", fmt::format("frames 0 to {}", frames - 1));
  }
  before.frame += static_cast<int>(step);
  KeptPlace out{.frame = before.frame};
  for (int i = 0; i < 3; ++i) {
    const std::int64_t change = get_signed_varint(in);
    if (change < -2 * most_steps || change > 2 * most_steps)
      in.fail("a foot out of this world", "places near the clip");
    before.steps[i] += change;
    if (std::abs(before.steps[i]) > most_steps) in.fail("a foot out of this world", "places near the clip");
    out.place(i) = static_cast<double>(before.steps[i]) * step_cm;
  }
  return out;
}

void put_slot(ByteWriter& out, const std::vector<KeptContact>& contacts, int slot) {
  put_varint(out, static_cast<std::uint64_t>(std::ranges::count(contacts, slot, &KeptContact::slot)));
  Before before;
  for (const KeptContact& c : contacts) {
    if (c.slot != slot) continue;
    put_varint(out, c.places.size() - 2);
    for (const KeptPlace& p : c.places) put_place(out, p, before);
  }
}

void get_slot(ByteReader& in, int slot, int frames, std::vector<KeptContact>& out) {
  const std::size_t count = get_count(in, 9, "contacts");
  Before before;
  for (std::size_t i = 0; i < count; ++i) {
    KeptContact contact{.slot = slot, .places = {}};
    const std::size_t places = get_count(in, 4, "places") + 2;
    for (std::size_t p = 0; p < places; ++p) {
      const int earlier = before.frame;
      contact.places.push_back(get_place(in, frames, before));
      if ((p > 0 || i > 0) && before.frame == earlier) in.fail("two places at one frame", "ascending frames");
    }
    out.push_back(std::move(contact));
  }
}

}  // namespace

FootContacts KeptFeet::frames() const {
  FootContacts out;
  for (const KeptContact& c : contacts) out.push_back({c.slot, c.first_frame(), c.last_frame()});
  return out;
}

std::optional<KeptFeet> keep_feet(const Clip& clip, const Placement& placement) {
  if (clip.rate_hz < least_contact_rate_hz || clip.frames > most_frames_with_feet) return std::nullopt;
  const std::optional<Feet> feet = find_feet(clip);
  if (!feet) return std::nullopt;
  const FootTracks tracks = foot_tracks(clip, *feet);
  const Ground ground = estimate_ground(tracks);
  const FootContacts contacts = ContactModel::standard().detect(tracks, ground);
  const std::optional<double> slide = foot_slide_cm_s(tracks, contacts);
  if (!slide) return std::nullopt;
  const IntoClip into(placement);
  KeptFeet out{.legs = feet->legs};
  for (std::size_t leg = 0; leg < 2; ++leg) out.knee_axes[leg] = mean_knee_axis(clip, feet->legs[leg]);
  out.floor_cm = ground.at(placement.start_cm) - placement.start_cm.y() - floor_penetration_cm(tracks, ground);
  out.floor_gradient = into.gradient(ground.gradient);
  out.slide_cm_s = *slide;
  for (const FootContact& c : contacts) {
    if (c.last_frame > c.first_frame) out.contacts.push_back(kept(tracks, c, into));
  }
  return out;
}

Bytes pack_feet(const KeptFeet& feet) {
  ByteWriter out;
  for (std::size_t i = 0; i < 2; ++i) {
    const Leg& leg = feet.legs[i];
    for (const int joint : {leg.hip, leg.knee, leg.ankle, leg.toe}) put_joint(out, joint);
    put_axis(out, feet.knee_axes[i]);
  }
  out.put(static_cast<float>(feet.floor_cm));
  for (int i = 0; i < 2; ++i) out.put(static_cast<float>(feet.floor_gradient(i)));
  out.put(static_cast<float>(feet.slide_cm_s));
  for (int slot = 0; slot < 4; ++slot) put_slot(out, feet.contacts, slot);
  return std::move(out).take();
}

KeptFeet unpack_feet(std::span<const std::byte> bytes, int frames, const Skeleton& skeleton,
                     const std::string& source) {
  ByteReader in(bytes, source);
  KeptFeet out;
  for (std::size_t i = 0; i < 2; ++i) {
    out.legs[i] = get_leg(in, skeleton);
    out.knee_axes[i] = get_axis(in);
  }
  out.floor_cm = get_number(in, "floor");
  for (int i = 0; i < 2; ++i) out.floor_gradient(i) = get_number(in, "slope");
  out.slide_cm_s = get_number(in, "slide");
  if (out.slide_cm_s < 0) in.fail("a slide below 0", "cm/s");
  for (int slot = 0; slot < 4; ++slot) get_slot(in, slot, frames, out.contacts);
  for (const KeptContact& c : out.contacts) {
    if (c.slot % 2 == 1 && out.legs[c.slot / 2].toe < 0) in.fail("contacts of a toe that is not there", "a joint");
  }
  in.expect_end();
  return out;
}

}  // namespace kinespace
