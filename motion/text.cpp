#include "kinespace/motion/text.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <span>
#include <system_error>
#include <utility>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

constexpr char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

bool same_word(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](char x, char y) { return lower(x) == lower(y); });
}

double detail::scan_rare_number(const char* first, const char* last) {
  const bool negative = *first == '-';
  if (*first == '-' || *first == '+') ++first;
  double value = 0;
  const auto [end, code] = std::from_chars(first, last, value);
  if (code == std::errc::result_out_of_range) {
    // from_chars does not say on which side: a number below one has its first digit behind the point that its exponent
    // sets.
    std::string_view text(first, static_cast<std::size_t>(last - first));
    const auto mark = text.find_first_of("eE");
    const auto point = std::min(text.find('.'), mark);
    const auto leading = text.find_first_of("123456789");
    long long exponent = 0;
    if (mark != std::string_view::npos) {
      const char* digits = text.data() + mark + 1;
      if (*digits == '+') ++digits;
      const auto parsed = std::from_chars(digits, last, exponent);
      constexpr long long beyond_all = 1'000'000'000'000;  // more digits than any text has
      if (parsed.ec == std::errc::result_out_of_range) exponent = *digits == '-' ? -beyond_all : beyond_all;
      exponent = std::clamp(exponent, -beyond_all, beyond_all);
    }
    const auto places = static_cast<long long>(std::min(point, text.size())) - static_cast<long long>(leading);
    value = exponent + places > 0 ? std::numeric_limits<double>::infinity() : 0;
  }
  return negative ? -value : value;
}

void append_fixed(std::string& out, double value) {
  constexpr double scale = 1e6;
  constexpr double largest = 9e12;  // scaled values stay below 2^63
  if (!(std::abs(value) < largest)) return append_exact(out, value);
  auto units = static_cast<std::int64_t>(std::nearbyint(value * scale));
  std::array<char, 24> text{};
  char* at = text.data() + text.size();
  const bool negative = units < 0;
  if (negative) units = -units;
  auto fraction = static_cast<std::uint32_t>(units % 1'000'000);
  auto whole = static_cast<std::uint64_t>(units / 1'000'000);
  if (fraction != 0) {
    int places = 6;
    for (; fraction % 10 == 0; --places) fraction /= 10;
    for (; places > 0; --places, fraction /= 10) *--at = static_cast<char>('0' + fraction % 10);
    *--at = '.';
  }
  do {
    *--at = static_cast<char>('0' + whole % 10);
    whole /= 10;
  } while (whole != 0);
  if (negative) *--at = '-';
  out.append(at, static_cast<std::size_t>(text.data() + text.size() - at));
}

void append_exact(std::string& out, double value) {
  std::array<char, 32> text{};
  const auto [end, code] = std::to_chars(text.data(), text.data() + text.size(), value + 0.0);  // no "-0"
  out.append(text.data(), static_cast<std::size_t>(end - text.data()));
}

TextSource::TextSource(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

TextSource::TextSource(const std::filesystem::path& path, std::size_t window_bytes)
    : name_(path.string()), file_(path) {
  window_.resize(std::min(window_bytes, file_->size()));
  text_ = {window_.data(), file_->read(window_)};
  find_whole_lines();
}

bool TextSource::more(const char*& at) {
  if (unread() == 0) return false;
  const char* keep = at;
  if (keep == end() && keep != begin() && keep[-1] == '\r') --keep;  // until it is known whether LF follows
  lines_dropped_ += line_ends_before(keep);
  const auto kept = static_cast<std::size_t>(end() - keep);
  const auto offset = at - keep;
  std::memmove(window_.data(), keep, kept);
  if (kept == window_.size()) window_.resize(std::min(2 * window_.size(), kept + unread()));
  const std::size_t got = file_->read(std::span(window_).subspan(kept));
  text_ = {window_.data(), kept + got};
  at = begin() + offset;
  find_whole_lines();
  return true;
}

void TextSource::find_whole_lines() {
  whole_lines_end_ = end();
  while (whole_lines_end_ != begin() && !is_line_end(whole_lines_end_[-1])) --whole_lines_end_;
}

void TextSource::read_line(const char*& at) {
  while (at >= whole_lines_end_ && more(at)) {
  }
}

std::int64_t TextSource::line_ends_before(const char* at) const {
  std::int64_t count = 0;
  for (const char* p = begin(); p != at; ++p) {
    if (*p == '\n' || (*p == '\r' && (p + 1 == end() || p[1] != '\n'))) ++count;
  }
  return count;
}

std::int64_t TextSource::line_of(const char* at) const {
  return 1 + lines_dropped_ + line_ends_before(at);
}

void TextSource::fail(const char* at, std::string found, std::string expected, std::string remedy) const {
  fail_in_line(line_of(at), std::move(found), std::move(expected), std::move(remedy));
}

void TextSource::fail_in_line(std::int64_t line, std::string found, std::string expected, std::string remedy) const {
  throw Error(ErrorKind::bad_input, {.file = name_,
                                     .line = line,
                                     .found = std::move(found),
                                     .expected = std::move(expected),
                                     .remedy = std::move(remedy)});
}

void TextSource::fail_at_word(const char* at, std::string expected, std::string remedy) const {
  while (at != end() && is_blank(*at)) ++at;
  constexpr std::size_t longest = 60;
  const std::string_view word = word_at(at, end());
  if (at + word.size() == end() && unread() > 0) fail_beyond_window();  // the rest of it is not in hand
  std::string found = at == end()        ? unread() == 0 ? "the end of the file" : "nothing more in its first 16 MiB"
                      : is_line_end(*at) ? "the end of the line"
                      : word.size() > longest ? "\"" + std::string(word.substr(0, longest)) + "...\""
                                              : "\"" + std::string(word) + "\"";
  fail(at, std::move(found), std::move(expected), std::move(remedy));
}

void TextSource::fail_beyond_window() const {
  fail(end(), "more than " + std::to_string(text_.size()) + " bytes before the first frame",
       "a description of the skeleton", "the file is damaged");
}

std::string_view word_at(const char* at, const char* end) {
  const char* last = at;
  while (last != end && !is_space(*last)) ++last;
  return {at, static_cast<std::size_t>(last - at)};
}

void require_honest_size(const TextSource& source, std::size_t joints, std::int64_t frames) {
  constexpr double bytes_each = 32;
  constexpr double always_allowed = 64.0 * 1024 * 1024;
  constexpr double most_a_byte = 64;
  const double wanted = static_cast<double>(joints) * static_cast<double>(frames) * bytes_each;
  if (wanted <= always_allowed + most_a_byte * static_cast<double>(source.size())) return;
  source.fail(source.end(),
              std::to_string(joints) + " joints in " + std::to_string(frames) + " frames from " +
                  std::to_string(source.size()) + " bytes",
              "a clip in proportion to its file", "the file is damaged or made to exhaust memory");
}

}  // namespace kinespace
