#include "kinespace/base/printable.h"

#include <random>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

TEST(Printable, letters_of_any_language_stay) {
  for (const char* text :
       {"walk", "caf\xc3\xa9", "\xe6\xad\xa9\xe3\x81\x8f", "\xf0\x9f\x9a\xb6 1", "a \"b\" 'c' \\ /"}) {
    EXPECT_EQ(printable(text), text);
    EXPECT_EQ(printable_lines(text), text);
  }
}

TEST(Printable, what_a_terminal_would_obey_becomes_question_marks) {
  EXPECT_EQ(printable("a\x1b[31mb\rc\nd\x07"), "a?[31mb?c?d?");
  EXPECT_EQ(printable(std::string_view("a\0b\x7f", 4)), "a?b?");
  EXPECT_EQ(printable("a\xc2\x9b"
                      "31m"),
            "a?31m")
      << "CSI as a C1 control";
  EXPECT_EQ(printable("a\xe2\x80\xae"
                      "fvb.exe"),
            "a?fvb.exe")
      << "right to left from here";
  EXPECT_EQ(printable("a\xe2\x80\xa8"
                      "b"),
            "a?b")
      << "a line separator";
}

TEST(Printable, lines_stay_where_they_are_meant) {
  EXPECT_EQ(printable_lines("a\nb\r\x1b\n"), "a\nb??\n");
}

TEST(Printable, what_is_not_utf8_becomes_question_marks) {
  EXPECT_EQ(printable("\x9b"
                      "31m"),
            "?31m");
  EXPECT_EQ(printable("\xc0\xaf"), "??") << "overlong";
  EXPECT_EQ(printable("\xe0\x80\x9b"), "???") << "overlong";
  EXPECT_EQ(printable("\xed\xa0\x80"), "???") << "a surrogate";
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "????") << "beyond Unicode";
  EXPECT_EQ(printable("walk\xc3"), "walk?") << "cut";
  EXPECT_EQ(printable("\xc3walk"), "?walk");
}

TEST(Printable, any_bytes_come_out_without_controls) {
  std::mt19937 random(5);
  for (int round = 0; round < 20000; ++round) {
    std::string bytes(random() % 12, 'x');
    for (char& c : bytes) c = static_cast<char>(random() % 3 == 0 ? 0x80 + random() % 0x40 : random());
    const std::string clean = printable(bytes);
    EXPECT_EQ(printable(clean), clean);
    for (std::size_t i = 0; i < clean.size(); ++i) {
      const auto c = static_cast<unsigned char>(clean[i]);
      EXPECT_FALSE(c < 0x20 || c == 0x7f);
      EXPECT_FALSE(c == 0xc2 && static_cast<unsigned char>(clean[i + 1]) < 0xa0);
    }
    const std::string part = file_name_part(bytes);
    EXPECT_FALSE(part.empty());
    EXPECT_EQ(part.find_first_of("/\\\n\x1b"), std::string::npos);
    EXPECT_NE(part.front(), '.');
  }
}

TEST(Printable, text_is_cut_between_characters) {
  EXPECT_EQ(cut_text("abc", 3), "abc");
  EXPECT_EQ(cut_text("abcd", 3), "abc");
  EXPECT_EQ(cut_text("ab\xc3\xa9", 3), "ab");
  EXPECT_EQ(cut_text("\xf0\x9f\x9a\xb6", 3), "");
  std::string message = format_error({.found = std::string(299, 'x') + "\xc3\xa9\xc3\xa9"});
  EXPECT_EQ(message, std::string(299, 'x') + "...");
}

TEST(Printable, a_name_becomes_a_part_of_a_path) {
  EXPECT_EQ(file_name_part("walk fast: 1"), "walk fast: 1");
  EXPECT_EQ(file_name_part("a/b\\c"), "a_b_c");
  EXPECT_EQ(file_name_part(".."), "_.");
  EXPECT_EQ(file_name_part(".hidden"), "_hidden");
  EXPECT_EQ(file_name_part(""), "_");
  EXPECT_EQ(file_name_part("C:x"), "C_x");
  EXPECT_EQ(file_name_part("\x1b]0;x\x07\n"), "_]0;x__");
  EXPECT_LE(file_name_part(std::string(5000, 'x')).size(), 200U);
}

TEST(Printable, a_name_with_folders_stays_below_where_it_is_put) {
  EXPECT_EQ(file_path_below("b/walk"), "b/walk");
  EXPECT_EQ(file_path_below("/etc/passwd"), "etc/passwd");
  EXPECT_EQ(file_path_below("../../x"), "_./_./x");
  EXPECT_EQ(file_path_below("a//./b/"), "a/_/b");
  EXPECT_EQ(file_path_below("C:/x\\y"), "C_/x_y");
  EXPECT_EQ(file_path_below("///"), "_");
  EXPECT_EQ(file_path_below(""), "_");
}

}  // namespace
}  // namespace kinespace
