#include "kinespace/base/error.h"

#include <gtest/gtest.h>

namespace kinespace {
namespace {

TEST(Error, its_message_is_one_line_with_all_that_is_known) {
  const Error error(ErrorKind::bad_input,
                    {.file = "a.bvh", .line = 12, .found = "'x'", .expected = "a number", .remedy = "mend the line"});
  EXPECT_STREQ(error.what(), "a.bvh:12: 'x', expected a number; mend the line");
  EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  EXPECT_EQ(error.details().line, 12);
}

TEST(Error, parts_that_are_missing_leave_no_gap) {
  EXPECT_EQ(format_error({.file = "a", .found = "nothing"}), "a: nothing");
  EXPECT_EQ(format_error({.file = "a", .expected = "more"}), "a: expected more");
  EXPECT_EQ(format_error({.found = "k = 0", .expected = "1 to 9"}), "k = 0, expected 1 to 9");
  EXPECT_EQ(format_error({}), "");
}

TEST(Error, what_a_terminal_would_obey_is_not_printed) {
  EXPECT_EQ(format_error({.file = "a\nb", .found = "\x1b[2J\x7f\t"}), "a?b: ?[2J??");
  EXPECT_EQ(format_error({.found = "caf\xc3\xa9"}), "caf\xc3\xa9") << "letters of any language are";
}

TEST(Error, a_long_part_is_cut) {
  EXPECT_LT(format_error({.found = std::string(100000, 'x')}).size(), 400U);
}

TEST(Error, the_kinds_are_the_exit_codes_of_the_command) {
  EXPECT_EQ(static_cast<int>(ErrorKind::bad_input), 1);
  EXPECT_EQ(static_cast<int>(ErrorKind::usage), 2);
  EXPECT_EQ(static_cast<int>(ErrorKind::machine), 3);
}

}  // namespace
}  // namespace kinespace
