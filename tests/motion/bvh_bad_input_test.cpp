#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/motion/bvh.h"
#include "tests/motion/sample_clips.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using testing::HasSubstr;

ErrorDetails bvh_error(std::string_view text) {
  return error_of([&] { static_cast<void>(parse_bvh(text, "bad.bvh", {.strict = true})); });
}

void expect_error(std::string_view text, int line, const std::string& found, const std::string& expected = "") {
  SCOPED_TRACE(found + " / " + expected);
  const ErrorDetails error = bvh_error(text);
  EXPECT_EQ(error.file, "bad.bvh");
  EXPECT_EQ(error.line, line);
  EXPECT_THAT(error.found, HasSubstr(found));
  EXPECT_THAT(error.expected, HasSubstr(expected));
}

TEST(BvhBadInput, an_empty_file_or_one_of_another_kind) {
  expect_error("", 1, "the end of the file", "HIERARCHY");
  expect_error(" \n\n", 3, "the end of the file", "HIERARCHY");
  expect_error("PK\x03\x04", 1, "PK", "HIERARCHY");
  expect_error(std::string(1000, '\0'), 1, "", "HIERARCHY");
  expect_error("HIERARCHY\n", 2, "the end of the file", "ROOT");
}

TEST(BvhBadInput, a_header_without_frames) {
  const std::string header(small_bvh.substr(0, small_bvh.find("0 90 0 0 0 0 10")));
  expect_error(header, 33, "0 frames of data", "3 as");
  expect_error(header.substr(0, header.find("Frames:")), 31, "the end of the file", "Frames");
  expect_error(header.substr(0, header.find("MOTION")), 30, "the end of the file", "MOTION");
}

TEST(BvhBadInput, a_frame_count_that_disagrees_with_the_data) {
  expect_error(replaced(small_bvh, "Frames: 3", "Frames: 4"), 36, "3 frames of data", "4 as");
  expect_error(replaced(small_bvh, "Frames: 3", "Frames: 2"), 35, "3 frames of data", "2 as");
  expect_error(replaced(small_bvh, "Frames: 3", "Frames: 0"), 31, "\"0\"", "from 1");
  expect_error(replaced(small_bvh, "Frames: 3", "Frames: -3"), 31, "\"-3\"", "from 1");
  expect_error(replaced(small_bvh, "Frames: 3", "Frames: 3.5"), 31, "\"3.5\"", "from 1");
  expect_error(replaced(small_bvh, "Frames: 3", "Frames: 2147483647"), 36, "3 frames of data", "2147483647");
  expect_error(replaced(small_bvh, "Frames: 3", "Frames: 99999999999999999999999"), 31, "\"999", "from 1");
  expect_error(replaced(small_bvh, "Frames: 3", "Frames:"), 32, "\"Frame\"", "from 1");
}

TEST(BvhBadInput, a_line_with_too_few_or_too_many_numbers) {
  expect_error(replaced(small_bvh, "20 30 5\n", "20 30\n"), 33, "9 numbers in the line", "10");
  expect_error(replaced(small_bvh, "20 30 5\n", "20 30 5 6\n"), 33, "more than 10 numbers", "10");
  expect_error(with_line(small_bvh, 34, "1 91"), 34, "2 numbers in the line", "10");
}

TEST(BvhBadInput, what_is_no_finite_number) {
  const std::string with_null(
      "1\0"
      "2",
      3);
  for (const std::string bad :
       {"nan", "NaN", "inf", "-inf", "1e999", "1.#QNAN", "0x1p3", "1,5", "--1", "1e", "1e10", "abc"}) {
    SCOPED_TRACE(bad);
    const ErrorDetails error = bvh_error(with_line(small_bvh, 34, "1 91 0.5 0 0 90 " + bad + " 20.25 1e1 -5.5"));
    EXPECT_EQ(error.line, 34);
    EXPECT_EQ(error.found, "\"" + bad + "\"");
    EXPECT_THAT(error.expected, HasSubstr("finite number"));
  }
  EXPECT_EQ(bvh_error(with_line(small_bvh, 34, "1 91 0.5 0 0 90 " + with_null + " 20.25 1e1 -5.5")).line, 34);
  expect_error(replaced(small_bvh, "OFFSET 10 -5 0", "OFFSET 10 nan 0"), 8, "\"nan\"", "offset");
  expect_error(replaced(small_bvh, "OFFSET 10 -5 0", "OFFSET 10 -5"), 9, "\"CHANNELS\"", "offset");
}

TEST(BvhBadInput, a_frame_time_that_is_none) {
  for (const char* bad : {"0", "-0.03", "nan", "1e-9", "1e7", "0,0333333", "inf"}) {
    expect_error(replaced(small_bvh, "0.0333333", bad), 32, std::string("\"") + bad + "\"", "frame time");
  }
  expect_error(replaced(small_bvh, "0.0333333", "0.0333333 7"), 32, "\"7\"", "end of the line");
}

TEST(BvhBadInput, channels_that_are_none) {
  const std::string line = "CHANNELS 3 Zrotation Xrotation Yrotation";
  expect_error(replaced(small_bvh, line, "CHANNELS 7 Zrotation Xrotation Yrotation"), 9, "\"7\"", "0 to 6");
  expect_error(replaced(small_bvh, line, "CHANNELS -1"), 9, "\"-1\"", "0 to 6");
  expect_error(replaced(small_bvh, line, "CHANNELS x"), 9, "\"x\"", "0 to 6");
  expect_error(replaced(small_bvh, line, "CHANNELS 3 Zrotation Xrotation Wrotation"), 9, "\"Wrotation\"", "Xposition");
  expect_error(replaced(small_bvh, line, "CHANNELS 3 Zrotation Xrotation Xrotation"), 9, "\"Xrotation\"", "once");
  expect_error(replaced(small_bvh, line, line + "\n" + line), 10, "", "one CHANNELS line");
  expect_error(replaced(small_bvh, line, "CHANNELS 4 Zrotation Xrotation Yrotation"), 10, "\"JOINT\"", "Xposition");
  const std::string none = "HIERARCHY ROOT a\n{ OFFSET 0 0 0 }\nMOTION\nFrames: 2\nFrame Time: 1\n\n\n";
  expect_error(none, 5, "without channels", "channels");
}

TEST(BvhBadInput, a_hierarchy_out_of_shape) {
  expect_error(replaced(small_bvh, "JOINT Head", "JOINT"), 20, "the end of the line", "name");
  expect_error(replaced(small_bvh, "ROOT Hips", "JOINT Hips"), 2, "\"JOINT\"", "ROOT");
  expect_error(replaced(small_bvh, "    OFFSET 0 60 0\n", ""), 27, "\"Head\" without OFFSET", "OFFSET");
  expect_error(replaced(small_bvh, "End Site", "End Sight"), 14, "\"Sight\"", "Site");
  expect_error(replaced(small_bvh, "MOTION", "ROOT Second"), 31, "\"Frames:\"", "{");
  expect_error(replaced(small_bvh, "MOTION", "}\nMOTION"), 30, "\"}\"", "MOTION");
  expect_error(replaced(small_bvh, "OFFSET 0 0 15", "JOINT a"), 16, "\"JOINT\"", "OFFSET, CHANNELS or }");
}

TEST(BvhBadInput, joints_nested_without_end) {
  std::string deep = "HIERARCHY\nROOT r {\n";
  for (int i = 0; i < 200000; ++i) deep += "JOINT a {\n";
  EXPECT_THAT(bvh_error(deep).found, HasSubstr("more than 1000 joints inside each other"));
}

TEST(BvhBadInput, a_small_file_that_asks_for_much_memory) {
  std::string greedy = "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n";
  for (int i = 0; i < 20000; ++i) greedy += "JOINT a{OFFSET 0 0 0}\n";
  greedy += "}\nMOTION\nFrames: 200000\nFrame Time: 1\n";  // 4e9 quaternions, 128 GB, from a file of 1 MB
  for (int i = 0; i < 200000; ++i) greedy += "0\n";
  EXPECT_THAT(bvh_error(greedy).found, HasSubstr("20001 joints in 200000 frames"));
}

TEST(BvhBadInput, text_in_utf_16) {
  expect_error(std::string("\xff\xfeH\0I\0", 6), 1, "UTF-16", "UTF-8");
  expect_error(std::string("\xfe\xff\0H\0I", 6), 1, "UTF-16", "UTF-8");
}

TEST(BvhBadInput, is_an_error_where_it_cannot_be_mended_either) {
  const auto lenient = [](std::string_view text) {
    return error_of([&] { static_cast<void>(parse_bvh(text, "bad.bvh")); });
  };
  const std::string header(small_bvh.substr(0, small_bvh.find("0 90 0 0 0 0 10")));
  EXPECT_THAT(lenient(header).found, HasSubstr("0 frames of data"));
  EXPECT_THAT(lenient(header + "1 2").found, HasSubstr("2 numbers"));
  EXPECT_THAT(lenient(with_line(small_bvh, 34, "1 91")).found, HasSubstr("2 numbers"));
  EXPECT_THAT(lenient(with_line(small_bvh, 34, "1 91 x 0 0 90 1 20.25 1e1 -5.5")).found, HasSubstr("\"x\""));
  EXPECT_THAT(lenient(replaced(small_bvh, "Frames: 3", "Frames: -3")).found, HasSubstr("-3"));
  const std::string lost = "nan nan nan nan nan nan nan nan nan nan\n";
  EXPECT_THAT(lenient(header + lost + lost).found, HasSubstr("nothing but lost frames"));
  EXPECT_THAT(lenient(replaced(small_bvh, "0.0333333", "0")).remedy, HasSubstr("--rate"));
}

TEST(BvhBadInput, the_message_names_file_and_line_on_one_line) {
  try {
    static_cast<void>(parse_bvh(replaced(small_bvh, "20.25", "na\x1bn"), "dir/bad.bvh"));
    FAIL();
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_THAT(message, testing::StartsWith("dir/bad.bvh:34: \"na?n\", expected "));
  }
}

TEST(BvhBadInput, a_missing_file) {
  const TemporaryFolder folder;
  EXPECT_THROW(static_cast<void>(read_bvh(folder / "none.bvh")), Error);
}

}  // namespace
}  // namespace kinespace::test
