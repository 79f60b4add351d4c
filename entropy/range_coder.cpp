#include "kinespace/entropy/range_coder.h"

namespace kinespace {

void RangeEncoder::shift_low() {
  if (low_ < 0xff000000U || low_ > 0xffffffffU) {
    const auto carry = static_cast<std::uint8_t>(low_ >> 32);
    if (!first_) out_.push_back(static_cast<std::byte>(held_ + carry));
    for (; pending_ > 0; --pending_) out_.push_back(static_cast<std::byte>(0xff + carry));
    held_ = static_cast<std::uint8_t>(low_ >> 24);
    first_ = false;
  } else {
    ++pending_;
  }
  low_ = (low_ & 0x00ffffffU) << 8;
}

Bytes RangeEncoder::finish() && {
  // Of the numbers in [low, low + range) the one with most zero bits at its end.
  const std::uint64_t high = low_ + range_ - 1;
  for (int zeros = 32; zeros >= 0; --zeros) {
    const std::uint64_t candidate = (high >> zeros) << zeros;
    if (candidate >= low_) {
      low_ = candidate;
      break;
    }
  }
  const std::size_t before = out_.size();
  for (int i = 0; i < 5; ++i) shift_low();
  // Of zeros only so many are left out that a decoder can tell a code from one that was cut short.
  const std::size_t least = out_.size() > before + 4 ? out_.size() - 4 : before;
  while (out_.size() > least && out_.back() == std::byte{0}) out_.pop_back();
  return std::move(out_);
}

}  // namespace kinespace
