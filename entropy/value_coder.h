// Whole numbers through the range coder with as many contexts as the caller likes: zero or not, sign, and an adaptive
// exponential-Golomb code of the size. What entropy/integer_model.h does for tables, for the numbers that a stream is
// made of.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/entropy/range_coder.h"

namespace kinespace {

struct ValueModels {
  static constexpr int exponents = 40;
  struct Context {
    AdaptiveBit nonzero;
    AdaptiveBit negative;
    std::array<AdaptiveBit, exponents> exponent;
    std::array<AdaptiveBit, exponents> mantissa;  // the digit after the first
  };
  explicit ValueModels(int contexts) : context(static_cast<std::size_t>(contexts)) {}
  std::vector<Context> context;
};

class ValueWriter {
 public:
  explicit ValueWriter(int contexts) : models_(contexts) {}

  // |value| < 2^38.
  void put(std::int64_t value, int context) {
    auto& model = models_.context[static_cast<std::size_t>(context)];
    coder_.encode(value != 0, model.nonzero);
    if (value == 0) return;
    coder_.encode(value < 0, model.negative);
    const auto size = static_cast<std::uint64_t>(value < 0 ? -value : value);
    const int exponent = bit_length(size) - 1;
    for (int e = 0; e <= exponent; ++e) coder_.encode(e < exponent, model.exponent[static_cast<std::size_t>(e)]);
    for (int i = exponent - 1; i >= 0; --i) {
      const bool bit = ((size >> i) & 1) != 0;
      if (i == exponent - 1) {
        coder_.encode(bit, model.mantissa[static_cast<std::size_t>(exponent)]);
      } else {
        coder_.encode_even(bit);
      }
    }
  }
  void put_bit(bool bit, int context) {
    coder_.encode(bit, models_.context[static_cast<std::size_t>(context)].nonzero);
  }
  [[nodiscard]] Bytes finish() && { return std::move(coder_).finish(); }

 private:
  ValueModels models_;
  RangeEncoder coder_;
};

// Reads what ValueWriter wrote. Throws Error{bad_input} naming `source` when the bytes run out or a number is too big.
class ValueReader {
 public:
  ValueReader(std::span<const std::byte> bytes, int contexts, std::string source)
      : models_(contexts), coder_(bytes), source_(std::move(source)) {}

  [[nodiscard]] std::int64_t get(int context) {
    if (coder_.overrun()) damaged();
    auto& model = models_.context[static_cast<std::size_t>(context)];
    if (!coder_.decode(model.nonzero)) return 0;
    const bool negative = coder_.decode(model.negative);
    int exponent = 0;
    while (coder_.decode(model.exponent[static_cast<std::size_t>(exponent)])) {
      if (++exponent == ValueModels::exponents - 1) damaged();
    }
    std::int64_t size = 1;
    for (int i = exponent - 1; i >= 0; --i) {
      const bool bit =
          i == exponent - 1 ? coder_.decode(model.mantissa[static_cast<std::size_t>(exponent)]) : coder_.decode_even();
      size = 2 * size + (bit ? 1 : 0);
    }
    return negative ? -size : size;
  }
  [[nodiscard]] std::int64_t get_between(std::int64_t least, std::int64_t most, int context) {
    const std::int64_t value = get(context);
    if (value < least || value > most) damaged();
    return value;
  }
  [[nodiscard]] bool get_bit(int context) {
    if (coder_.overrun()) damaged();
    return coder_.decode(models_.context[static_cast<std::size_t>(context)].nonzero);
  }
  // To be called after the last number.
  void expect_end() const {
    if (coder_.overrun() || !coder_.used_up()) damaged();
  }
  [[noreturn]] void damaged() const {
    throw Error(ErrorKind::bad_input, {.file = source_,
                                       .found = "numbers that end too early or too late, or are out of range",
                                       .expected = "what the encoder writes (damaged)"});
  }

 private:
  ValueModels models_;
  RangeDecoder coder_;
  std::string source_;
};

}  // namespace kinespace
