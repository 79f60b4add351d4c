#include "kinespace/entropy/range_coder.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/entropy/integer_coder.h"

namespace kinespace {
namespace {

std::vector<bool> random_bits(int count, double ones, unsigned seed) {
  std::mt19937 generator(seed);
  std::vector<bool> out;
  for (int i = 0; i < count; ++i) out.push_back(static_cast<double>(generator()) < ones * 4294967296.0);
  return out;
}

Bytes coded(const std::vector<bool>& bits) {
  RangeEncoder encoder;
  AdaptiveBit model;
  for (const bool b : bits) encoder.encode(b, model);
  return std::move(encoder).finish();
}

TEST(RangeCoder, decisions_come_back_whatever_their_odds_and_number) {
  for (const double ones : {0.0, 0.001, 0.3, 0.5, 0.999, 1.0}) {
    for (const int count : {0, 1, 2, 7, 8, 9, 100, 5000}) {
      const std::vector<bool> bits = random_bits(count, ones, static_cast<unsigned>(count));
      const Bytes code = coded(bits);
      RangeDecoder decoder(code);
      AdaptiveBit model;
      for (const bool b : bits) ASSERT_EQ(decoder.decode(model), b) << ones << " " << count;
      EXPECT_FALSE(decoder.overrun());
      EXPECT_TRUE(decoder.used_up());
    }
  }
}

TEST(RangeCoder, costs_the_entropy_of_the_decisions) {
  for (const double p : {0.02, 0.1, 0.5}) {
    const int count = 200000;
    const double entropy = -(p * std::log2(p) + (1 - p) * std::log2(1 - p)) * count / 8;
    const double bytes = static_cast<double>(coded(random_bits(count, p, 3)).size());
    EXPECT_LT(bytes, 1.05 * entropy + 4) << p;  // models that follow what changes never settle quite
    EXPECT_GT(bytes, 0.98 * entropy) << p;
  }
}

TEST(RangeCoder, long_runs_of_the_likely_decision_cost_next_to_nothing) {
  EXPECT_LT(coded(std::vector<bool>(100000, true)).size(), 40U);
}

TEST(RangeCoder, carries_run_through_any_number_of_full_bytes) {
  // Even decisions of all ones and zeros by turns of many lengths: low comes near the top of its range.
  for (int run = 1; run < 200; ++run) {
    RangeEncoder encoder;
    for (int i = 0; i < run; ++i) encoder.encode_even(false);
    for (int i = 0; i < 40; ++i) encoder.encode_even(i % 3 == 0);
    const Bytes code = std::move(encoder).finish();
    RangeDecoder decoder(code);
    for (int i = 0; i < run; ++i) ASSERT_FALSE(decoder.decode_even());
    for (int i = 0; i < 40; ++i) ASSERT_EQ(decoder.decode_even(), i % 3 == 0);
  }
}

TEST(RangeCoder, a_code_that_was_cut_or_prolonged_is_noticed) {
  const std::vector<bool> bits = random_bits(4000, 0.4, 9);
  Bytes code = coded(bits);
  const auto state = [&](std::span<const std::byte> bytes) {
    RangeDecoder decoder(bytes);
    AdaptiveBit model;
    for (std::size_t i = 0; i < bits.size(); ++i) static_cast<void>(decoder.decode(model));
    return std::pair(decoder.overrun(), decoder.used_up());
  };
  EXPECT_EQ(state(code), std::pair(false, true));
  EXPECT_TRUE(state(std::span(code).first(code.size() / 2)).first);
  code.resize(code.size() + 8, std::byte{0x55});
  EXPECT_FALSE(state(code).second);
}

TEST(IntegerModel, whole_numbers_of_any_size_come_back) {
  std::vector<std::int64_t> numbers{0, 1, -1, 2, -2, 3, 1000, -1000, (std::int64_t{1} << 37), -(std::int64_t{1} << 37)};
  IntegerWriter out;
  for (const std::int64_t n : numbers) out.put(n, static_cast<int>(n & 7));
  for (int b = 0; b < 256; ++b) out.put_byte(static_cast<std::uint8_t>(b), static_cast<std::uint8_t>(b / 2));
  const Bytes code = std::move(out).finish();
  IntegerReader in(code, "numbers");
  for (const std::int64_t n : numbers) ASSERT_EQ(in.get(static_cast<int>(n & 7)), n);
  for (int b = 0; b < 256; ++b) ASSERT_EQ(in.get_byte(static_cast<std::uint8_t>(b / 2)), b);
  EXPECT_NO_THROW(in.expect_end());
}

TEST(IntegerModel, reading_past_the_end_is_an_error_and_not_an_endless_loop) {
  IntegerWriter out;
  out.put(5);
  const Bytes code = std::move(out).finish();
  IntegerReader in(code, "numbers");
  EXPECT_THROW(
      {
        for (int i = 0; i < 100000; ++i) static_cast<void>(in.get_between(-1000000, 1000000));
      },
      Error);
}

}  // namespace
}  // namespace kinespace
