#include "kinespace/base/printable.h"

namespace kinespace {
namespace {

constexpr std::size_t longest_part = 200;  // file systems take 255, and endings and numbers follow

struct Character {
  std::uint32_t code = 0;
  std::size_t bytes = 0;  // 0: no well-formed UTF-8 starts here
};

// Well-formed as in table 3-7 of the Unicode standard: nothing overlong, no surrogates, nothing above U+10FFFF.
Character character_at_start(std::string_view text) {
  const auto byte = [&](std::size_t i) -> std::uint32_t {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0;
  };
  const auto follows = [&](std::size_t i) { return (byte(i) & 0xC0U) == 0x80U; };
  const std::uint32_t first = byte(0);
  if (first < 0x80) return {first, 1};
  if (first >= 0xC2 && first < 0xE0 && follows(1)) return {(first & 0x1FU) << 6 | (byte(1) & 0x3FU), 2};
  if ((first & 0xF0U) == 0xE0U && follows(1) && follows(2)) {
    const std::uint32_t code = (first & 0x0FU) << 12 | (byte(1) & 0x3FU) << 6 | (byte(2) & 0x3FU);
    return code >= 0x800 && (code < 0xD800 || code > 0xDFFF) ? Character{code, 3} : Character{};
  }
  if (first >= 0xF0 && first < 0xF5 && follows(1) && follows(2) && follows(3)) {
    const std::uint32_t code =
        (first & 0x07U) << 18 | (byte(1) & 0x3FU) << 12 | (byte(2) & 0x3FU) << 6 | (byte(3) & 0x3FU);
    return code >= 0x10000 && code <= 0x10FFFF ? Character{code, 4} : Character{};
  }
  return {};
}

bool is_obeyed(std::uint32_t code) {
  const auto in = [code](std::uint32_t low, std::uint32_t high) { return code >= low && code <= high; };
  const bool control = code < 0x20 || in(0x7F, 0x9F);
  const bool separator = in(0x2028, 0x2029);
  const bool direction = code == 0x061C || in(0x200E, 0x200F) || in(0x202A, 0x202E) || in(0x2066, 0x2069);
  return control || separator || direction;
}

}  // namespace

CharacterOfText first_character(std::string_view text) {
  const auto [code, bytes] = character_at_start(text);
  if (bytes == 0) return {static_cast<unsigned char>(text.front()), 1, false, true};
  return {code, bytes, true, is_obeyed(code)};
}

namespace {

std::string cleaned(std::string_view text, char instead, bool keep_lines) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const CharacterOfText next = first_character(text);
    const bool stays = next.well_formed && (!next.obeyed || (keep_lines && next.code == '\n'));
    stays ? out.append(text.substr(0, next.bytes)) : out.append(1, instead);
    text.remove_prefix(next.bytes);
  }
  return out;
}

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

}  // namespace

std::string printable(std::string_view text) {
  return cleaned(text, '?', false);
}

std::string printable_lines(std::string_view text) {
  return cleaned(text, '?', true);
}

std::string_view cut_text(std::string_view text, std::size_t bytes) {
  if (text.size() <= bytes) return text;
  std::size_t end = bytes;
  // A character has at most three bytes that follow its first.
  while (end > 0 && bytes - end < 3 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return text.substr(0, end);
}

std::string file_name_part(std::string_view name) {
  std::string out(cut_text(cleaned(name, '_', false), longest_part));
  for (char& c : out) {
    if (c == '/' || c == '\\') c = '_';
  }
  if (out.size() >= 2 && is_letter(out[0]) && out[1] == ':') out[1] = '_';
  if (out.empty()) out = "_";
  if (out.front() == '.') out.front() = '_';
  return out;
}

std::string file_path_below(std::string_view name) {
  std::string out;
  while (!name.empty()) {
    const std::size_t end = name.find('/');
    const std::string_view part = name.substr(0, end);
    if (!part.empty()) out.append(out.empty() ? "" : "/").append(file_name_part(part));
    name.remove_prefix(end == std::string_view::npos ? name.size() : end + 1);
  }
  return out.empty() ? file_name_part({}) : out;
}

}  // namespace kinespace
