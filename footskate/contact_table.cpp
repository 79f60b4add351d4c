// The bytes of contact models, and the model that comes with the library.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "kinespace/base/bytes.h"
#include "kinespace/footskate/contact_model.h"

namespace kinespace {
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
