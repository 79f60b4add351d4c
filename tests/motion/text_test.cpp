#include "kinespace/motion/text.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace kinespace {
namespace {

// The value when the whole text is one number.
std::optional<double> scan(const std::string& text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  if (scan_number(text.data(), end, value) != end) return std::nullopt;
  return value;
}

double correctly_rounded(std::string_view text) {
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

TEST(ScanNumber, is_as_exact_as_from_chars_for_random_numbers_of_every_shape) {
  std::mt19937_64 random(1);
  const auto pick = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most + 1)); };
  for (int i = 0; i < 200000; ++i) {
    std::string text = pick(1) == 0 ? "-" : "";
    const int whole = pick(i % 3 == 0 ? 22 : 4);
    const int fraction = pick(i % 5 == 0 ? 25 : 8);
    for (int d = 0; d < whole; ++d) text += static_cast<char>('0' + pick(9));
    if (fraction > 0 || whole == 0) text += '.';
    for (int d = 0; d < fraction || (whole == 0 && d == 0); ++d) text += static_cast<char>('0' + pick(9));
    if (pick(3) == 0) text.append("e").append(std::to_string(pick(60) - 30));
    const auto value = scan(text);
    ASSERT_TRUE(value) << text;
    ASSERT_EQ(*value, correctly_rounded(text)) << text;
  }
}

TEST(ScanNumber, reads_every_double_back_from_its_shortest_text) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 100000; ++i) {
    const double value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) continue;
    std::string text;
    append_exact(text, value);
    ASSERT_EQ(scan(text), value) << text;
  }
}

TEST(ScanNumber, takes_every_way_files_write_numbers) {
  EXPECT_EQ(scan("+1.5"), 1.5);
  EXPECT_EQ(scan(".5"), 0.5);
  EXPECT_EQ(scan("5."), 5);
  EXPECT_EQ(scan("-2.E+0"), -2);
  EXPECT_EQ(scan("1.13307e-013"), 1.13307e-13);
  EXPECT_EQ(scan("7E2"), 700);
  EXPECT_EQ(scan("0000000000000000000000000000001.25"), 1.25);
  EXPECT_EQ(scan("0.000000000000000000000000000000000000000000125e40"), 1.25e-3);
  EXPECT_TRUE(std::signbit(*scan("-0")));
}

TEST(ScanNumber, tells_too_large_from_too_small) {
  EXPECT_EQ(scan("1e400"), std::numeric_limits<double>::infinity());
  EXPECT_EQ(scan("-1e400"), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(scan("1e-400"), 0);
  EXPECT_EQ(scan("-0.0000001e-400"), 0);
  EXPECT_EQ(scan("1e99999999999999999999"), std::numeric_limits<double>::infinity());
  EXPECT_EQ(scan("1e-99999999999999999999"), 0);
  EXPECT_EQ(scan("35e9223372036854775807"), std::numeric_limits<double>::infinity());
  EXPECT_EQ(scan("0.0035e-9223372036854775808"), 0);
  EXPECT_EQ(scan("0e99999999999999999999"), 0);
  std::string long_number(400, '9');
  EXPECT_EQ(scan(long_number), std::numeric_limits<double>::infinity());
  long_number.append("e-399");
  EXPECT_EQ(scan(long_number), 10);
  long_number.assign("0.").append(400, '0').append("1");
  EXPECT_EQ(scan(long_number), 0);
}

TEST(ScanNumber, takes_nothing_that_is_no_number) {
  for (const char* text : {"", "-", "+", ".", "-.", "e5", "1e", "1e+", "1e-", "nan", "inf", "-inf", "0x10", "--1",
                           "+-1", "1.#IND", "1,5"}) {
    EXPECT_FALSE(scan(text)) << text;
  }
}

TEST(AppendFixed, writes_at_most_six_decimals_and_no_more_than_needed) {
  const auto text = [](double value) {
    std::string out;
    append_fixed(out, value);
    return out;
  };
  EXPECT_EQ(text(0), "0");
  EXPECT_EQ(text(-0.0), "0");
  EXPECT_EQ(text(-1e-9), "0");
  EXPECT_EQ(text(12), "12");
  EXPECT_EQ(text(-0.5), "-0.5");
  EXPECT_EQ(text(93.523), "93.523");
  EXPECT_EQ(text(0.000001), "0.000001");
  EXPECT_EQ(text(-123456.7890125), "-123456.789012");
  EXPECT_EQ(text(1e20), "1e+20");
}

TEST(AppendFixed, is_off_by_half_a_unit_of_the_sixth_decimal_at_most) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> values(-2000, 2000);
  for (int i = 0; i < 100000; ++i) {
    const double value = values(random);
    std::string out;
    append_fixed(out, value);
    ASSERT_NEAR(scan(out).value(), value, 0.5000001e-6) << out;
  }
}

TEST(TextSource, counts_lines_of_every_kind) {
  const TextSource source("a\nb\r\nc\rd", "x");
  EXPECT_EQ(source.line_of(source.begin()), 1);
  EXPECT_EQ(source.line_of(source.begin() + 2), 2);
  EXPECT_EQ(source.line_of(source.begin() + 5), 3);
  EXPECT_EQ(source.line_of(source.begin() + 7), 4);
}

}  // namespace
}  // namespace kinespace
