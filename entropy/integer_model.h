// Whole numbers of any size through the range coder, most of them small: zero or not, sign, and an adaptive
// exponential-Golomb code; each with one of a few contexts that the caller chooses. For the tables of a stream, where
// there are too few numbers for anything finer. Bytes go through a binary tree with a context of eight bits.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/entropy/range_coder.h"

namespace kinespace {

struct IntegerModels {
  static constexpr int contexts = 16;
  static constexpr int exponents = 40;
  std::array<AdaptiveBit, contexts> nonzero;
  std::array<AdaptiveBit, contexts> sign;
  std::array<std::array<AdaptiveBit, exponents>, contexts> exponent;
  std::vector<AdaptiveBit> byte_tree = std::vector<AdaptiveBit>(std::size_t{256} * 256);
};

class IntegerWriter {
 public:
  // |value| < 2^38; context below IntegerModels::contexts.
  void put(std::int64_t value, int context = 0) {
    const auto c = static_cast<std::size_t>(context);
    coder_.encode(value != 0, models_.nonzero[c]);
    if (value == 0) return;
    coder_.encode(value < 0, models_.sign[c]);
    const auto size = static_cast<std::uint64_t>(value < 0 ? -value : value);
    const int exponent = bit_length(size) - 1;
    for (int e = 0; e <= exponent; ++e) coder_.encode(e < exponent, models_.exponent[c][static_cast<std::size_t>(e)]);
    for (int i = exponent - 1; i >= 0; --i) coder_.encode_even(((size >> i) & 1) != 0);
  }
  void put_byte(std::uint8_t byte, std::uint8_t context) {
    std::size_t node = 1;
    for (int i = 7; i >= 0; --i) {
      const bool bit = ((byte >> i) & 1) != 0;
      coder_.encode(bit, models_.byte_tree[std::size_t{256} * context + node]);
      node = 2 * node + (bit ? 1 : 0);
    }
  }
  [[nodiscard]] Bytes finish() && { return std::move(coder_).finish(); }

 private:
  IntegerModels models_;
  RangeEncoder coder_;
};

// Reads what IntegerWriter wrote. Throws Error{bad_input} naming `source` when the bytes run out or a number is too
// big.
class IntegerReader {
 public:
  IntegerReader(std::span<const std::byte> bytes, std::string source) : coder_(bytes), source_(std::move(source)) {}

  [[nodiscard]] std::int64_t get(int context = 0) {
    if (coder_.overrun()) damaged();
    const auto c = static_cast<std::size_t>(context);
    if (!coder_.decode(models_.nonzero[c])) return 0;
    const bool negative = coder_.decode(models_.sign[c]);
    int exponent = 0;
    while (coder_.decode(models_.exponent[c][static_cast<std::size_t>(exponent)])) {
      if (++exponent == IntegerModels::exponents - 1) damaged();
    }
    std::int64_t size = 1;
    for (int i = 0; i < exponent; ++i) size = 2 * size + (coder_.decode_even() ? 1 : 0);
    return negative ? -size : size;
  }
  // The same within [least, most].
  [[nodiscard]] std::int64_t get_between(std::int64_t least, std::int64_t most, int context = 0) {
    const std::int64_t value = get(context);
    if (value < least || value > most) damaged();
    return value;
  }
  [[nodiscard]] std::uint8_t get_byte(std::uint8_t context) {
    if (coder_.overrun()) damaged();
    std::size_t node = 1;
    while (node < 256) node = 2 * node + (coder_.decode(models_.byte_tree[std::size_t{256} * context + node]) ? 1 : 0);
    return static_cast<std::uint8_t>(node);
  }
  // To be called after the last number.
  void expect_end() const {
    if (coder_.overrun() || !coder_.used_up()) damaged();
  }
  [[noreturn]] void damaged() const {
    throw Error(ErrorKind::bad_input, {.file = source_,
                                       .found = "a table that ends too early or too late, or has numbers out of range",
                                       .expected = "what the encoder writes (damaged)"});
  }

 private:
  IntegerModels models_;
  RangeDecoder coder_;
  std::string source_;
};

}  // namespace kinespace
