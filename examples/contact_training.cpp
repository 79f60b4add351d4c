#include "examples/contact_training.h"

#include <array>
#include <string_view>

namespace kinespace {
namespace {

std::string base64(const Bytes& bytes) {
  constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  unsigned held = 0;
  unsigned bits = 0;
  const auto put = [&] {
    while (bits >= 6) {
      bits -= 6;
      out += letters[(held >> bits) & 63U];
    }
  };
  for (const std::byte b : bytes) {
    held = (held << 8U) | std::to_integer<unsigned>(b);
    bits += 8;
    put();
  }
  if (bits > 0) {
    held <<= 6 - bits;
    bits = 6;
    put();
  }
  return out;
}

}  // namespace

FootContacts contacts_of(const SampleMotion& motion, const Feet& feet) {
  FootContacts out;
  const auto joints = feet.foot_joints();
  for (int slot = 0; slot < 4; ++slot) {
    for (const Contact& c : motion.contacts) {
      if (c.joint == joints[slot]) out.push_back({slot, c.first_frame, c.last_frame});
    }
  }
  return out;
}

ContactModel train_standard_contacts() {
  std::vector<LabelledClip> clips;
  std::uint64_t seed = 1000;
  for (const double height : {140.0, 175.0, 205.0}) {
    for (const double rate : {30.0, 60.0, 120.0}) {
      for (const SampleMotion& m : sample_library({.seed = seed++, .takes = 1, .rate_hz = rate, .height_cm = height})) {
        clips.push_back({.clip = m.clip, .contacts = contacts_of(m, require_feet(m.clip)), .feet = {}});
      }
    }
  }
  return ContactModel::train(clips);
}

std::string standard_contact_table() {
  const std::string text = base64(train_standard_contacts().to_bytes());
  constexpr std::size_t width = 116;
  std::string out;
  for (std::size_t at = 0; at < text.size(); at += width) out += "\"" + text.substr(at, width) + "\"\n";
  return out;
}

}  // namespace kinespace
