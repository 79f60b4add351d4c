// An adaptive binary range coder: yes/no decisions in, about as many bytes out as the decisions are surprising.
//
// The coder is the byte-wise carry-propagating one (martin 1979; LZMA's arrangement): a 32-bit range is split in
// proportion to the probability of a 1, and the half of the decision becomes the new range. A decision of probability p
// costs -log2 p bits to within 1e-4. Everything is integer arithmetic, so streams and decisions are the same on every
// machine.
//
// AdaptiveBit is what the coder knows about one kind of decision: the mean of a quick and a slow running estimate. The
// first decisions move both faster (by 1 / (seen + 1.5)), so that a short stream learns at once.
//
// Hostile bytes: a decoder that has run past its bytes goes on with zeros and says so (overrun()); it never reads
// outside, and decisions always come out. What the decisions mean is for the caller to check.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "kinespace/base/bytes.h"

namespace kinespace {

// Binary digits of a number: 0 for 0.
[[nodiscard]] constexpr int bit_length(std::uint64_t value) noexcept {
  return static_cast<int>(std::bit_width(value));
}

class AdaptiveBit {
 public:
  AdaptiveBit() = default;
  // Starts from a probability of a 1 that was learned elsewhere, in 1/65536; `trust` as if so many decisions were seen.
  AdaptiveBit(std::uint16_t probability, std::uint8_t trust) : quick_(probability), slow_(probability), seen_(trust) {}

  // Of a 1, in 1/65536: never below 2^-11 / 2 nor above 1 - that.
  [[nodiscard]] std::uint32_t probability() const noexcept {
    const std::uint32_t p = (static_cast<std::uint32_t>(quick_) + slow_) / 2;
    return p < least ? least : p > 65536 - least ? 65536 - least : p;
  }
  void learn(bool bit) noexcept {
    const int slow = slow_shift[seen_];
    const int quick = slow < quickest ? slow : quickest;
    if (seen_ + 1 < static_cast<int>(slow_shift.size())) ++seen_;
    if (bit) {
      quick_ = static_cast<std::uint16_t>(quick_ + ((65535 - quick_) >> quick));
      slow_ = static_cast<std::uint16_t>(slow_ + ((65535 - slow_) >> slow));
    } else {
      quick_ = static_cast<std::uint16_t>(quick_ - (quick_ >> quick));
      slow_ = static_cast<std::uint16_t>(slow_ - (slow_ >> slow));
    }
  }

 private:
  static constexpr std::uint32_t least = 24;
  static constexpr int quickest = 5;
  static constexpr std::array<std::uint8_t, 32> slow_shift{1, 2, 2, 3, 3, 3, 4, 4, 4, 4, 4, 4, 5, 5, 5, 5,
                                                           5, 5, 5, 5, 5, 5, 5, 5, 6, 6, 6, 6, 6, 6, 6, 7};
  std::uint16_t quick_ = 32768;
  std::uint16_t slow_ = 32768;
  std::uint8_t seen_ = 0;
};

class RangeEncoder {
 public:
  void encode(bool bit, AdaptiveBit& model) {
    split(bit, model.probability());
    model.learn(bit);
  }
  // A decision of even odds that nothing is learned from.
  void encode_even(bool bit) { split(bit, 32768); }

  // Ends the code in as few bytes as it takes; zeros at the end are left out (the decoder puts them back).
  [[nodiscard]] Bytes finish() &&;

 private:
  void split(bool bit, std::uint32_t probability) {
    const std::uint32_t ones = (range_ >> 16) * probability;
    if (bit) {
      range_ = ones;
    } else {
      low_ += ones;
      range_ -= ones;
    }
    while (range_ < (1U << 24)) {
      range_ <<= 8;
      shift_low();
    }
  }
  void shift_low();

  std::uint64_t low_ = 0;
  std::uint32_t range_ = 0xffffffffU;
  std::uint8_t held_ = 0;      // the byte a carry may still change
  std::uint64_t pending_ = 0;  // 0xff bytes behind it
  bool first_ = true;          // nothing held yet
  Bytes out_;
};

class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const std::byte> bytes) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) code_ = (code_ << 8) | next();
  }

  [[nodiscard]] bool decode(AdaptiveBit& model) noexcept {
    const bool bit = split(model.probability());
    model.learn(bit);
    return bit;
  }
  [[nodiscard]] bool decode_even() noexcept { return split(32768); }

  // Whether more bytes were asked for than a whole code can ask for beyond its end.
  [[nodiscard]] bool overrun() const noexcept { return missing_ > allowed_missing; }
  // Whether all bytes were used: a code with bytes to spare was not made by RangeEncoder.
  [[nodiscard]] bool used_up() const noexcept { return at_ == bytes_.size(); }

 private:
  static constexpr std::size_t allowed_missing = 4;
  [[nodiscard]] bool split(std::uint32_t probability) noexcept {
    const std::uint32_t ones = (range_ >> 16) * probability;
    const bool bit = code_ < ones;
    if (bit) {
      range_ = ones;
    } else {
      code_ -= ones;
      range_ -= ones;
    }
    while (range_ < (1U << 24)) {
      range_ <<= 8;
      code_ = (code_ << 8) | next();
    }
    return bit;
  }
  std::uint32_t next() noexcept {
    if (at_ < bytes_.size()) return static_cast<std::uint32_t>(bytes_[at_++]);
    ++missing_;
    return 0;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::size_t missing_ = 0;
  std::uint32_t range_ = 0xffffffffU;
  std::uint32_t code_ = 0;
};

}  // namespace kinespace
