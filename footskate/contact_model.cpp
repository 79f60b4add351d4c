#include "kinespace/footskate/contact_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "kinespace/base/bytes.h"

namespace kinespace {
namespace {

constexpr std::size_t neighbours = 5;
constexpr float unlike_anything = 0.25F;  // leg lengths: no labelled keyframe within it
constexpr float very_like = 0.1F;         // so near that "not planted" outweighs a rest

// The distance of the nearest keyframe and the share of the nearest ones in which ankle and toe stand.
struct Vote {
  float distance = std::numeric_limits<float>::infinity();
  std::array<double, 2> share{};
};

Vote vote(const std::vector<LabelledKeyframe>& keyframes, const Keyframe& query) {
  std::array<float, neighbours> nearest;
  std::array<std::uint8_t, neighbours> planted{};
  nearest.fill(std::numeric_limits<float>::infinity());
  for (const LabelledKeyframe& k : keyframes) {
    const float d = squared_distance(k.keyframe, query);
    if (d >= nearest.back()) continue;
    std::size_t at = neighbours - 1;
    for (; at > 0 && nearest[at - 1] > d; --at) {
      nearest[at] = nearest[at - 1];
      planted[at] = planted[at - 1];
    }
    nearest[at] = d;
    planted[at] = k.planted;
  }
  Vote out{.distance = std::sqrt(nearest.front())};
  double all = 0;
  for (std::size_t i = 0; i < std::min(neighbours, keyframes.size()); ++i) {
    const double weight = 1 / (nearest[i] + 4e-4);
    all += weight;
    for (std::size_t joint = 0; joint < 2; ++joint) out.share[joint] += ((planted[i] >> joint) & 1U) != 0 ? weight : 0;
  }
  for (double& share : out.share) share /= std::max(all, 1e-300);
  return out;
}

// Whether a joint may stand at a frame at all.
class Plausible {
 public:
  Plausible(const FootTracks& tracks, const Ground& ground)
      : t_(tracks),
        level_{levels_under(tracks, ground, 0), levels_under(tracks, ground, 1)},
        stand_(standing_heights(tracks, ground)) {}

  [[nodiscard]] bool operator()(int slot, int f) const {
    const double length = t_.feet.leg_length_cm;
    const double height = t_.at[slot][f].y() - level_[slot / 2][f] - stand_[slot];
    const Eigen::Vector3d v = t_.velocity(t_.at[slot], f);
    const Eigen::Vector3d root = t_.velocity(t_.root, f);
    const double allowed = 0.5 * length + 0.5 * std::hypot(root.x(), root.z());
    return std::abs(height) <= 0.08 * length && std::hypot(v.x(), v.z()) <= allowed;
  }

 private:
  const FootTracks& t_;
  std::array<std::vector<double>, 2> level_;
  std::array<double, 4> stand_;
};

// Sets runs of at most `longest` frames between set ones: votes waver.
void close_gaps(std::vector<char>& planted, int longest) {
  int last = -1;
  for (int f = 0; f < static_cast<int>(planted.size()); ++f) {
    if (planted[f] == 0) continue;
    if (last >= 0 && f - last - 1 <= longest) std::fill(planted.begin() + last, planted.begin() + f, 1);
    last = f;
  }
}

// Adds what the rule plants for long and the votes do not, where no labelled keyframe is very like; but for the ends.
FootContacts with_missed(const FootContacts& found, const FootContacts& by_rule,
                         const std::array<std::vector<float>, 2>& distance, double rate_hz) {
  const int shortest = static_cast<int>(std::ceil(0.2 * rate_hz));
  const int end = static_cast<int>(std::ceil(0.05 * rate_hz));
  const int frames = static_cast<int>(distance[0].size());
  FootContacts out;
  for (int slot = 0; slot < 4; ++slot) {
    std::vector<char> planted = planted_frames(found, slot, frames);
    for (const FootContact& c : by_rule) {
      const int length = c.last_frame - c.first_frame + 1;
      if (c.slot != slot || length < shortest) continue;
      const auto near = distance[slot / 2].begin();
      const auto known =
          std::count_if(near + c.first_frame, near + c.last_frame + 1, [](float d) { return d <= very_like; });
      if (2 * known >= length) continue;
      const int first = c.first_frame == 0 ? 0 : c.first_frame + end;
      const int last = c.last_frame == frames - 1 ? c.last_frame : c.last_frame - end;
      std::fill(planted.begin() + first, planted.begin() + last + 1, 1);
    }
    append_runs(planted, slot, out);
  }
  return out;
}

}  // namespace

FootContacts ContactModel::detect(const FootTracks& tracks, const Ground& ground) const {
  const FootContacts by_rule = contacts_by_rule(tracks, ground);
  const Plausible plausible(tracks, ground);
  std::array<std::vector<float>, 2> distance;
  FootContacts found;
  for (int leg = 0; leg < 2; ++leg) {
    std::array<std::vector<char>, 2> planted = {planted_frames(by_rule, 2 * leg, tracks.frames),
                                                planted_frames(by_rule, 2 * leg + 1, tracks.frames)};
    distance[leg].assign(tracks.frames, std::numeric_limits<float>::infinity());
    const std::vector<Keyframe> queries = keyframes_of(tracks, ground, leg);
    for (std::size_t f = 0; f < queries.size(); ++f) {
      const Vote v = vote(keyframes_, queries[f]);
      distance[leg][f] = v.distance;
      if (v.distance > unlike_anything) continue;
      for (int joint = 0; joint < 2; ++joint) {
        planted[joint][f] = v.share[joint] >= 0.5 && plausible(2 * leg + joint, static_cast<int>(f)) ? 1 : 0;
      }
    }
    for (auto& frames : planted) close_gaps(frames, static_cast<int>(0.06 * tracks.rate_hz));
    for (int joint = 0; joint < 2; ++joint) append_runs(planted[joint], 2 * leg + joint, found);
  }
  return with_missed(fit_ends(tracks, found), by_rule, distance, tracks.rate_hz);
}

std::vector<double> ContactModel::distances(const FootTracks& tracks, const Ground& ground) const {
  std::vector<double> out(tracks.frames, keyframes_.empty() ? std::numeric_limits<double>::infinity() : 0.0);
  for (int leg = 0; leg < 2; ++leg) {
    const std::vector<Keyframe> queries = keyframes_of(tracks, ground, leg);
    for (std::size_t f = 0; f < queries.size(); ++f) {
      out[f] = std::max(out[f], static_cast<double>(vote(keyframes_, queries[f]).distance));
    }
  }
  return out;
}

ContactModel ContactModel::train(std::span<const LabelledClip> clips, double apart) {
  const auto limit = static_cast<float>(apart * apart);
  std::vector<LabelledKeyframe> kept;
  for (const LabelledClip& labelled : clips) {
    const FootTracks tracks = foot_tracks(labelled.clip, require_feet(labelled.clip, labelled.feet));
    const Ground ground = estimate_ground(tracks);
    for (int leg = 0; leg < 2; ++leg) {
      const std::vector<Keyframe> all = keyframes_of(tracks, ground, leg);
      const auto ankle = planted_frames(labelled.contacts, 2 * leg, tracks.frames);
      const auto toe = planted_frames(labelled.contacts, 2 * leg + 1, tracks.frames);
      for (std::size_t f = 0; f < all.size(); ++f) {
        const auto planted = static_cast<std::uint8_t>((ankle[f] != 0 ? 1 : 0) | (toe[f] != 0 ? 2 : 0));
        const bool known = std::ranges::any_of(kept, [&](const LabelledKeyframe& k) {
          return k.planted == planted && squared_distance(k.keyframe, all[f]) < limit;
        });
        if (!known) kept.push_back({all[f], planted});
      }
    }
  }
  return ContactModel(std::move(kept));
}

ContactModel ContactModel::with(const ContactModel& more) const {
  std::vector<LabelledKeyframe> all = keyframes_;
  all.insert(all.end(), more.keyframes_.begin(), more.keyframes_.end());
  return ContactModel(std::move(all));
}

// The bytes of contact models, and the model that comes with the library.

namespace {

constexpr double steps = 8192;  // a leg length; numbers reach to +-4 of them

constexpr std::string_view standard_table =
#include "kinespace/footskate/standard_contacts.inc"
    ;

// The value of a letter of base 64; -1: none.
int digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+') return 62;
  return c == '/' ? 63 : -1;
}

Bytes from_base64(std::string_view text) {
  Bytes out;
  out.reserve(text.size() * 3 / 4);
  unsigned held = 0;
  int bits = 0;
  for (const char c : text) {
    if (digit(c) < 0) continue;
    held = (held << 6U) | static_cast<unsigned>(digit(c));
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    out.push_back(static_cast<std::byte>((held >> static_cast<unsigned>(bits)) & 0xffU));
  }
  return out;
}

}  // namespace

Bytes ContactModel::to_bytes() const {
  ByteWriter out;
  out.put(static_cast<std::uint32_t>(keyframes_.size()));
  for (const LabelledKeyframe& k : keyframes_) {
    for (const float value : k.keyframe) {
      out.put(static_cast<std::int16_t>(std::lround(std::clamp(static_cast<double>(value), -3.99, 3.99) * steps)));
    }
    out.put(k.planted);
  }
  return std::move(out).take();
}

ContactModel ContactModel::from_bytes(std::span<const std::byte> bytes, const std::string& source) {
  ByteReader in(bytes, source);
  const auto count = in.get<std::uint32_t>();
  std::vector<LabelledKeyframe> keyframes;
  keyframes.reserve(std::min<std::size_t>(count, bytes.size() / (2 * Keyframe{}.size())));
  for (std::uint32_t i = 0; i < count; ++i) {
    LabelledKeyframe k;
    for (float& value : k.keyframe) value = static_cast<float>(in.get<std::int16_t>() / steps);
    k.planted = in.get<std::uint8_t>();
    if (k.planted > 3) in.fail("a label " + std::to_string(k.planted), "0 to 3");
    keyframes.push_back(k);
  }
  in.expect_end();
  return ContactModel(std::move(keyframes));
}

const ContactModel& ContactModel::standard() {
  static const ContactModel model = from_bytes(from_base64(standard_table), "the standard contact model");
  return model;
}

}  // namespace kinespace
