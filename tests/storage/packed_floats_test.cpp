#include "kinespace/storage/packed_floats.h"

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

std::vector<std::uint32_t> bits(const std::vector<float>& values) {
  std::vector<std::uint32_t> out;
  out.reserve(values.size());
  for (const float value : values) out.push_back(std::bit_cast<std::uint32_t>(value));
  return out;
}

std::vector<float> smooth(std::size_t count) {
  std::vector<float> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = std::sin(0.01F * static_cast<float>(i));
  return values;
}

TEST(PackedFloats, every_size_around_a_run_comes_back_bit_for_bit) {
  for (const std::size_t count : {0, 1, 2, 3, 16383, 16384, 16385, 50001}) {
    std::vector<float> values = smooth(count);
    if (count > 2) {
      values[0] = std::numeric_limits<float>::quiet_NaN();
      values[1] = -0.0F;
      values[2] = -std::numeric_limits<float>::infinity();
    }
    EXPECT_EQ(bits(unpack_floats(pack_floats(values), count, "test")), bits(values)) << count;
  }
}

TEST(PackedFloats, smooth_curves_shrink_and_noise_costs_one_byte) {
  const std::vector<float> curve = smooth(100000);
  EXPECT_LT(pack_floats(curve).size(), curve.size() * sizeof(float) * 8 / 10);

  std::mt19937 random(1);
  std::vector<float> noise(1000);
  for (float& value : noise) value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
  const Bytes packed = pack_floats(noise);
  EXPECT_LE(packed.size(), noise.size() * sizeof(float) + 1);
  EXPECT_EQ(bits(unpack_floats(packed, noise.size(), "test")), bits(noise));
}

TEST(PackedFloats, few_bytes_never_unfold_into_many) {
  const std::vector<float> zeros(8'000'000);
  const Bytes packed = pack_floats(zeros);
  EXPECT_GE(packed.size() * 16 + (2U << 20U), zeros.size() * sizeof(float));
  EXPECT_EQ(unpack_floats(packed, zeros.size(), "test"), zeros);
  // The same frame without the padding is what an attacker would send.
  const std::span<const std::byte> bare = std::span(packed).first(packed.size() / 2);
  EXPECT_THROW(static_cast<void>(unpack_floats(bare, zeros.size(), "test")), Error);
}

TEST(PackedFloats, another_count_is_an_error) {
  const std::vector<float> values = smooth(1000);
  const Bytes packed = pack_floats(values);
  for (const std::size_t count :
       {std::size_t{0}, std::size_t{999}, std::size_t{1001}, std::numeric_limits<std::size_t>::max() / 2}) {
    EXPECT_THROW(static_cast<void>(unpack_floats(packed, count, "test")), Error) << count;
  }
}

TEST(PackedFloats, every_prefix_and_every_flipped_byte_is_an_error_or_floats) {
  const std::vector<float> values = smooth(300);
  const Bytes packed = pack_floats(values);
  for (std::size_t size = 0; size < packed.size(); ++size) {
    EXPECT_THROW(static_cast<void>(unpack_floats(std::span(packed).first(size), values.size(), "test")), Error);
  }
  for (std::size_t at = 0; at < packed.size(); ++at) {
    for (const int mask : {1, 0x80, 0xff}) {
      Bytes flipped = packed;
      flipped[at] ^= static_cast<std::byte>(mask);
      try {
        EXPECT_EQ(unpack_floats(flipped, values.size(), "test").size(), values.size());
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      }
    }
  }
}

TEST(PackedFloats, a_level_outside_its_range_is_named) {
  try {
    static_cast<void>(pack_floats(smooth(1), {.level = 99}));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_NE(std::string(error.what()).find("level = 99"), std::string::npos);
  }
}

}  // namespace
}  // namespace kinespace
