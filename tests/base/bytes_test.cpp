#include "kinespace/base/bytes.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kinespace {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(Bytes, what_was_put_is_got_in_the_same_order) {
  ByteWriter out;
  out.put(std::uint8_t{7});
  out.put(-1.5);
  out.put(std::numeric_limits<std::int64_t>::min());
  out.put_string("with \0 zero");
  out.put_array(std::span<const float>(std::vector<float>{1, 2, 3}));
  out.put_bytes(std::vector<std::byte>{std::byte{9}});
  const Bytes bytes = std::move(out).take();

  ByteReader in(bytes, "test");
  EXPECT_EQ(in.get<std::uint8_t>(), 7);
  EXPECT_EQ(in.get<double>(), -1.5);
  EXPECT_EQ(in.get<std::int64_t>(), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(in.get_string(), "with \0 zero");
  EXPECT_THAT(in.get_array<float>(3), ElementsAre(1, 2, 3));
  EXPECT_EQ(in.take(1)[0], std::byte{9});
  EXPECT_NO_THROW(in.expect_end());
}

TEST(Bytes, numbers_lie_little_end_first) {
  ByteWriter out;
  out.put(std::uint32_t{0x01020304});
  EXPECT_THAT(out.bytes(), ElementsAre(std::byte{4}, std::byte{3}, std::byte{2}, std::byte{1}));
}

TEST(Bytes, reading_behind_the_end_is_an_error_that_names_the_source) {
  const Bytes three(3);
  const auto message = [&three](const auto& act) {
    try {
      ByteReader in(three, "walk.ksm");
      act(in);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      EXPECT_EQ(error.details().file, "walk.ksm");
      return std::string(error.what());
    }
    ADD_FAILURE() << "no error";
    return std::string();
  };
  EXPECT_THAT(message([](ByteReader& in) { in.get<double>(); }), HasSubstr("3 bytes left, expected 8 more"));
  EXPECT_THAT(message([](ByteReader& in) { in.take(4); }), HasSubstr("3 bytes left"));
  EXPECT_THAT(message([](ByteReader& in) { in.get_string(); }), HasSubstr("3 bytes left"));
  EXPECT_THAT(message([](ByteReader& in) { in.expect_end(); }), HasSubstr("3 extra bytes"));
}

TEST(Bytes, a_length_that_is_a_lie_is_refused_before_anything_is_allocated) {
  ByteWriter out;
  out.put(std::uint32_t{0xffffffff});
  out.put(std::uint32_t{0});
  ByteReader string(out.bytes(), "test");
  EXPECT_THROW(string.get_string(), Error);
  ByteReader array(out.bytes(), "test");
  EXPECT_THROW(array.get_array<double>(2), Error);
  EXPECT_THROW(array.get_array<double>(std::numeric_limits<std::uint64_t>::max()), Error);
  EXPECT_THROW(array.get_array<double>(std::numeric_limits<std::uint64_t>::max() / 8 + 1), Error) << "overflows";
  EXPECT_EQ(array.get_array<double>(1).size(), 1U) << "a failed read takes nothing";
}

}  // namespace
}  // namespace kinespace
