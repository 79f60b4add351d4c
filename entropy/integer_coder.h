// Whole numbers of any size through the range coder, most of them small: zero or not, sign, and an adaptive
// exponential-Golomb code of the size; each with one of the contexts that the caller chooses. Two codes of the kind: that of
// tables, where there are too few numbers for anything finer, and that of the numbers a stream is made of, in which the
// digit after the first has a model too. Bytes go through a binary tree with a context of eight bits.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/entropy/range_coder.h"

namespace kinespace {

struct IntegerModels {
  static constexpr int exponents = 40;
  struct Context {
    AdaptiveBit nonzero;
    AdaptiveBit negative;
    std::array<AdaptiveBit, exponents> exponent;
    std::array<AdaptiveBit, exponents> digit;  // the one after the first, where it has a model
  };
  explicit IntegerModels(int contexts) : context(static_cast<std::size_t>(contexts)) {}

  [[nodiscard]] Context& at(int number) { return context[static_cast<std::size_t>(number)]; }
  // Made when the first byte comes.
  [[nodiscard]] AdaptiveBit* tree(std::uint8_t byte_context) {
    if (byte_trees.empty()) byte_trees.resize(std::size_t{256} * 256);
    return byte_trees.data() + std::size_t{256} * byte_context;
  }

  std::vector<Context> context;
  std::vector<AdaptiveBit> byte_trees;
};

// `models_digit`: which of the two codes.
template <bool models_digit>
class IntegerEncoder {
 public:
  explicit IntegerEncoder(int contexts) : models_(contexts) {}

  // |value| < 2^38; context below their number.
  void put(std::int64_t value, int context = 0) {
    IntegerModels::Context& model = models_.at(context);
    coder_.encode(value != 0, model.nonzero);
    if (value == 0) return;
    coder_.encode(value < 0, model.negative);
    const auto size = static_cast<std::uint64_t>(value < 0 ? -value : value);
    const int exponent = bit_length(size) - 1;
    for (int e = 0; e <= exponent; ++e) coder_.encode(e < exponent, model.exponent[static_cast<std::size_t>(e)]);
    for (int i = exponent - 1; i >= 0; --i) {
      const bool bit = ((size >> i) & 1) != 0;
      if (models_digit && i == exponent - 1) {
        coder_.encode(bit, model.digit[static_cast<std::size_t>(exponent)]);
      } else {
        coder_.encode_even(bit);
      }
    }
  }
  void put_bit(bool bit, int context) { coder_.encode(bit, models_.at(context).nonzero); }
  void put_byte(std::uint8_t byte, std::uint8_t context) {
    AdaptiveBit* const tree = models_.tree(context);
    std::size_t node = 1;
    for (int i = 7; i >= 0; --i) {
      const bool bit = ((byte >> i) & 1) != 0;
      coder_.encode(bit, tree[node]);
      node = 2 * node + (bit ? 1 : 0);
    }
  }
  [[nodiscard]] Bytes finish() && { return std::move(coder_).finish(); }

 private:
  IntegerModels models_;
  RangeEncoder coder_;
};

// Reads what IntegerEncoder wrote. Throws Error{bad_input} naming `source` when the bytes run out or a number is too big.
template <bool models_digit>
class IntegerDecoder {
 public:
  IntegerDecoder(std::span<const std::byte> bytes, int contexts, std::string source)
      : models_(contexts), coder_(bytes), source_(std::move(source)) {}

  [[nodiscard]] std::int64_t get(int context = 0) {
    if (coder_.overrun()) damaged();
    IntegerModels::Context& model = models_.at(context);
    if (!coder_.decode(model.nonzero)) return 0;
    const bool negative = coder_.decode(model.negative);
    int exponent = 0;
    while (coder_.decode(model.exponent[static_cast<std::size_t>(exponent)])) {
      if (++exponent == IntegerModels::exponents - 1) damaged();
    }
    std::int64_t size = 1;
    for (int i = exponent - 1; i >= 0; --i) {
      const bool with_model = models_digit && i == exponent - 1;
      const bool bit =
          with_model ? coder_.decode(model.digit[static_cast<std::size_t>(exponent)]) : coder_.decode_even();
      size = 2 * size + (bit ? 1 : 0);
    }
    return negative ? -size : size;
  }
  // The same within [least, most].
  [[nodiscard]] std::int64_t get_between(std::int64_t least, std::int64_t most, int context = 0) {
    const std::int64_t value = get(context);
    if (value < least || value > most) damaged();
    return value;
  }
  [[nodiscard]] bool get_bit(int context) {
    if (coder_.overrun()) damaged();
    return coder_.decode(models_.at(context).nonzero);
  }
  [[nodiscard]] std::uint8_t get_byte(std::uint8_t context) {
    if (coder_.overrun()) damaged();
    AdaptiveBit* const tree = models_.tree(context);
    std::size_t node = 1;
    while (node < 256) node = 2 * node + (coder_.decode(tree[node]) ? 1 : 0);
    return static_cast<std::uint8_t>(node);
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
  IntegerModels models_;
  RangeDecoder coder_;
  std::string source_;
};

// Of the numbers that a stream is made of.
using ValueWriter = IntegerEncoder<true>;
using ValueReader = IntegerDecoder<true>;

// Of tables: 16 contexts.
struct IntegerWriter : IntegerEncoder<false> {
  IntegerWriter() : IntegerEncoder(16) {}
};
struct IntegerReader : IntegerDecoder<false> {
  IntegerReader(std::span<const std::byte> bytes, std::string source) : IntegerDecoder(bytes, 16, std::move(source)) {}
};

}  // namespace kinespace
