#include "kinespace/storage/varint.h"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace kinespace {
namespace {

constexpr std::uint64_t largest = std::numeric_limits<std::uint64_t>::max();

ByteReader reader(const Bytes& bytes) {
  return {bytes, "test"};
}

TEST(Varint, numbers_come_back_and_take_the_bytes_they_need) {
  for (const std::uint64_t value : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{127}, std::uint64_t{128},
                                    std::uint64_t{16383}, std::uint64_t{16384}, largest / 2, largest}) {
    ByteWriter out;
    put_varint(out, value);
    EXPECT_EQ(out.size(), varint_size(value));
    ByteReader in = reader(out.bytes());
    EXPECT_EQ(get_varint(in), value);
    EXPECT_EQ(in.remaining(), 0U);
  }
  EXPECT_EQ(varint_size(127), 1U);
  EXPECT_EQ(varint_size(128), 2U);
  EXPECT_EQ(varint_size(largest), 10U);
}

TEST(Varint, small_numbers_of_either_sign_are_short) {
  for (const std::int64_t value : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{63}, std::int64_t{-64}}) {
    ByteWriter out;
    put_signed_varint(out, value);
    EXPECT_EQ(out.size(), 1U) << value;
  }
  for (const std::int64_t value :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(), std::int64_t{-65}}) {
    ByteWriter out;
    put_signed_varint(out, value);
    ByteReader in = reader(out.bytes());
    EXPECT_EQ(get_signed_varint(in), value);
  }
}

TEST(Varint, a_number_that_is_too_long_too_large_or_cut_is_an_error) {
  const std::vector<std::vector<int>> wrong = {
      {},                                                                // nothing
      {0x80},                                                            // cut short
      {0x80, 0x00},                                                      // 0 in two bytes
      {0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x02},      // 65 bits
      {0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 1}};  // 11 bytes
  for (const auto& raw : wrong) {
    Bytes bytes;
    for (const int byte : raw) bytes.push_back(static_cast<std::byte>(byte));
    ByteReader in = reader(bytes);
    EXPECT_THROW(static_cast<void>(get_varint(in)), Error) << raw.size();
  }
}

TEST(Varint, a_count_that_cannot_fit_is_refused_before_anything_is_allocated) {
  ByteWriter out;
  put_varint(out, largest);
  out.put(std::uint64_t{0});
  ByteReader in = reader(out.bytes());
  EXPECT_THROW(static_cast<void>(get_count(in, 1, "things")), Error);

  ByteWriter fits;
  put_varint(fits, 2);
  fits.put(std::uint64_t{0});
  ByteReader two = reader(fits.bytes());
  EXPECT_EQ(get_count(two, 4, "things"), 2U);
}

}  // namespace
}  // namespace kinespace
