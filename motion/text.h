// Numbers and lines of text files: what the BVH, ASF and AMC readers and writers share.
//
// Numbers are read as std::from_chars reads them (correctly rounded, no locale, '.' as the decimal point; a leading '+'
// is allowed). A number with at most 19 digits whose digits fit 2^53 and whose power of ten is at most 22 is one exact
// integer times or over one exact power of ten, so a single rounding (W. D. Clinger, How to read floating point
// numbers accurately, 1990); the rest goes to std::from_chars.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/base/file.h"

namespace kinespace {

[[nodiscard]] constexpr bool is_line_end(char c) {
  return c == '\n' || c == '\r';
}
[[nodiscard]] constexpr bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}
[[nodiscard]] constexpr bool is_space(char c) {
  return is_blank(c) || is_line_end(c);
}
[[nodiscard]] constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

// ASCII case does not matter.
[[nodiscard]] bool same_word(std::string_view a, std::string_view b);

// No length in cm and no angle in degrees of a motion is larger; what is, is damage. Keeps every later sum finite.
inline constexpr double largest_number = 1e9;

namespace detail {
inline constexpr std::array<double, 23> powers_of_ten = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                         1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                         1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
// The number in [first, last), which is known to be well formed. +-infinity when it is too large.
[[nodiscard]] double scan_rare_number(const char* first, const char* last);
}  // namespace detail

// Reads the number at `at` and returns where it ends; nullptr when there is no number there (nan, inf and hexadecimal
// are none). A number too large for a double is +-infinity, one too small is zero.
[[nodiscard]] inline const char* scan_number(const char* at, const char* end, double& value) {
  const char* const first = at;
  const bool negative = at != end && *at == '-';
  if (negative || (at != end && *at == '+')) ++at;
  std::uint64_t digits = 0;
  const char* const whole = at;
  for (; at != end && is_digit(*at); ++at) digits = digits * 10 + static_cast<std::uint64_t>(*at - '0');
  auto count = at - whole;
  std::int64_t exponent = 0;
  if (at != end && *at == '.') {
    const char* const fraction = ++at;
    for (; at != end && is_digit(*at); ++at) digits = digits * 10 + static_cast<std::uint64_t>(*at - '0');
    exponent = fraction - at;
    count += at - fraction;
  }
  if (count == 0) return nullptr;
  if (at != end && (*at == 'e' || *at == 'E')) {
    const char* power = at + 1;
    const bool down = power != end && *power == '-';
    if (down || (power != end && *power == '+')) ++power;
    if (power == end || !is_digit(*power)) return nullptr;
    std::int64_t shift = 0;
    for (; power != end && is_digit(*power); ++power) shift = shift < 100000 ? shift * 10 + (*power - '0') : shift;
    exponent += down ? -shift : shift;
    at = power;
  }
  constexpr std::uint64_t exact = std::uint64_t{1} << 53;
  if (count <= 19 && digits <= exact && exponent >= -22 && exponent <= 22) [[likely]] {
    const auto magnitude = static_cast<double>(digits);
    const double scaled = exponent < 0 ? magnitude / detail::powers_of_ten[static_cast<std::size_t>(-exponent)]
                                       : magnitude * detail::powers_of_ten[static_cast<std::size_t>(exponent)];
    value = negative ? -scaled : scaled;
  } else {
    value = detail::scan_rare_number(first, at);
  }
  return at;
}

// Appends the number with at most 6 decimals, trailing zeros left out, never in exponent form: "-0.5", "12", "0".
void append_fixed(std::string& out, double value);
// Appends the shortest text that reads back as the same number.
void append_exact(std::string& out, double value);

// A text and its name, for messages: a string, or a file of which a window is in memory, so that a recording of any
// length takes no more than its numbers do. [begin(), end()) is what is in hand; hold_line and more go on in the file,
// drop what lies before `at`, and move `at` along with the text that it points to.
class TextSource {
 public:
  TextSource(std::string_view text, std::string name);
  // Throws Error as FileReader does. The window grows where a line needs it to.
  explicit TextSource(const std::filesystem::path& path, std::size_t window_bytes = std::size_t{16} << 20);
  TextSource(const TextSource&) = delete;
  TextSource& operator=(const TextSource&) = delete;

  [[nodiscard]] const char* begin() const { return text_.data(); }
  [[nodiscard]] const char* end() const { return text_.data() + text_.size(); }
  [[nodiscard]] const std::string& name() const { return name_; }
  // Bytes of the whole text, and of what follows `at`.
  [[nodiscard]] std::size_t size() const { return file_ ? file_->size() : text_.size(); }
  [[nodiscard]] std::size_t remaining(const char* at) const { return static_cast<std::size_t>(end() - at) + unread(); }

  // Afterwards the rest of the line at `at` is in hand.
  void hold_line(const char*& at) {
    if (at >= whole_lines_end_ && unread() > 0) [[unlikely]]
      read_line(at);
  }
  // When there is more than is in hand: some of it comes into hand, and true.
  [[nodiscard]] bool more(const char*& at);

  // The line of a place, from 1. A line ends at LF, CR LF or CR.
  [[nodiscard]] std::int64_t line_of(const char* at) const;
  // Throws Error{bad_input} about a place in the text.
  [[noreturn]] void fail(const char* at, std::string found, std::string expected, std::string remedy = {}) const;
  [[noreturn]] void fail_in_line(std::int64_t line, std::string found, std::string expected,
                                 std::string remedy = {}) const;
  // The same, quoting the word at that place, or "the end of the line" or "of the file".
  [[noreturn]] void fail_at_word(const char* at, std::string expected, std::string remedy = {}) const;
  // That what must be in hand as a whole is longer than the window.
  [[noreturn]] void fail_beyond_window() const;

 private:
  [[nodiscard]] std::size_t unread() const { return file_ ? file_->remaining() : 0; }
  [[nodiscard]] std::int64_t line_ends_before(const char* at) const;
  void find_whole_lines();
  void read_line(const char*& at);

  std::string_view text_;
  std::string name_;
  std::optional<FileReader> file_;
  std::vector<char> window_;
  const char* whole_lines_end_ = nullptr;  // behind the last line end in the window; its begin where there is none
  std::int64_t lines_dropped_ = 0;
};

// The word (no white space in it) that starts at `at`; empty at white space and at the end.
[[nodiscard]] std::string_view word_at(const char* at, const char* end);

// Throws Error{bad_input} when a clip of that size cannot come from an honest file of that many bytes: rotations take
// 32 bytes a joint and frame, and joints without channels cost a file nothing, so a small file could ask for all
// memory.
void require_honest_size(const TextSource& source, std::size_t joints, std::int64_t frames);

}  // namespace kinespace
