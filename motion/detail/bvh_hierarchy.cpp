#include "kinespace/motion/detail/bvh_hierarchy.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace kinespace {
namespace {

constexpr std::size_t deepest = 1000;
constexpr int end_site_level = -1;

// Words, where a brace is a word of its own.
class HierarchyWords {
 public:
  explicit HierarchyWords(const TextSource& source) : source_(source), at_(source.begin()), end_(source.end()) {
    constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
    if (std::string_view(at_, static_cast<std::size_t>(end_ - at_)).starts_with(byte_order_mark))
      at_ += byte_order_mark.size();
  }

  [[nodiscard]] const char* at() const { return at_; }
  [[nodiscard]] const TextSource& source() const { return source_; }

  // The next word, empty at the end; at() is left where it starts.
  std::string_view peek() {
    while (at_ != end_ && is_space(*at_)) ++at_;
    if (at_ == end_) return {};
    if (*at_ == '{' || *at_ == '}') return {at_, 1};
    const char* last = at_;
    while (last != end_ && !is_space(*last) && *last != '{' && *last != '}') ++last;
    return {at_, static_cast<std::size_t>(last - at_)};
  }
  void skip(std::string_view word) { at_ += word.size(); }
  [[nodiscard]] bool take(std::string_view word) {
    const auto next = peek();
    if (!same_word(next, word)) return false;
    skip(next);
    return true;
  }
  void require(std::string_view word, const std::string& expected, const std::string& remedy = {}) {
    if (!take(word)) fail(expected, remedy);
  }
  [[noreturn]] void fail(const std::string& expected, const std::string& remedy = {}) {
    while (at_ != end_ && is_space(*at_)) ++at_;
    source_.fail_at_word(at_, expected, remedy);
  }

  // The rest of the line up to a brace, runs of white space as one space.
  std::string take_name() {
    std::string name;
    for (; at_ != end_ && !is_line_end(*at_) && *at_ != '{'; ++at_) {
      if (!is_blank(*at_)) {
        name += *at_;
      } else if (!name.empty() && name.back() != ' ') {
        name += ' ';
      }
    }
    if (!name.empty() && name.back() == ' ') name.pop_back();
    return name;
  }

  double take_number(const std::string& expected) {
    const auto word = peek();
    double value = 0;
    const char* const stop = scan_number(word.data(), word.data() + word.size(), value);
    if (word.empty() || stop != word.data() + word.size() || !(std::abs(value) <= largest_number)) fail(expected);
    skip(word);
    return value;
  }

  std::int64_t take_integer(const std::string& expected, std::int64_t least, std::int64_t most) {
    const auto word = peek();
    std::int64_t value = 0;
    const auto [stop, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || code != std::errc() || stop != word.data() + word.size() || value < least || value > most) {
      fail(expected);
    }
    skip(word);
    return value;
  }

 private:
  const TextSource& source_;
  const char* at_;
  const char* end_;
};

class Hierarchy {
 public:
  explicit Hierarchy(HierarchyWords& words) : words_(words) {}

  // Into the header: the skeleton and its roots.
  void parse(BvhHeader& header) && {
    words_.require("HIERARCHY", "HIERARCHY, the first word of a BVH file", "check that this is a BVH file");
    words_.require("ROOT", "ROOT and the name of the first joint");
    do {
      header.roots.push_back(static_cast<int>(joints_.size()));
      open_joint();
      while (!levels_.empty()) statement();
    } while (words_.take("ROOT"));
    header.skeleton.joints = std::move(joints_);
  }

 private:
  Joint& joint() { return joints_[static_cast<std::size_t>(levels_.back())]; }

  void open_joint() {
    Joint joint{.name = words_.take_name(), .parent = levels_.empty() ? -1 : levels_.back()};
    if (joint.name.empty()) words_.source().fail_at_word(words_.at(), "the name of a joint");
    joints_.push_back(std::move(joint));
    has_offset_.push_back(false);
    open(static_cast<int>(joints_.size()) - 1);
  }

  void open(int level) {
    words_.require("{", "{");
    if (levels_.size() == deepest) {
      words_.source().fail(words_.at(), "more than " + std::to_string(deepest) + " joints inside each other",
                           "a skeleton of fewer levels");
    }
    levels_.push_back(level);
  }

  void statement() {
    const bool in_end_site = levels_.back() == end_site_level;
    if (words_.take("}")) return close();
    if (words_.take("OFFSET")) return offset(in_end_site);
    if (words_.take("CHANNELS")) return in_end_site ? end_site_channels() : channels();
    if (!in_end_site) {
      if (words_.take("JOINT")) return open_joint();
      if (words_.take("End")) {
        words_.require("Site", "Site after End");
        static_cast<void>(words_.take_name());
        return open(end_site_level);
      }
    }
    words_.fail(in_end_site ? "OFFSET, CHANNELS or }" : "OFFSET, CHANNELS, JOINT, End Site or }",
                words_.peek().empty() ? "the file is cut short" : "");
  }

  void offset(bool in_end_site) {
    Eigen::Vector3d value;
    for (int axis = 0; axis < 3; ++axis) value[axis] = words_.take_number("an offset of three numbers");
    if (in_end_site) {
      const int parent = levels_[levels_.size() - 2];
      joints_[static_cast<std::size_t>(parent)].end_site = value;
    } else {
      joint().offset = value;
      has_offset_[static_cast<std::size_t>(levels_.back())] = true;
    }
  }

  // An End Site that has channels is a joint without a name.
  void end_site_channels() {
    const auto word = words_.peek();
    if (word == "0") return words_.skip(word);
    const int parent = levels_[levels_.size() - 2];
    std::optional<Eigen::Vector3d>& site = joints_[static_cast<std::size_t>(parent)].end_site;
    has_offset_.push_back(site.has_value());
    levels_.back() = static_cast<int>(joints_.size());
    Joint end{.name = joints_[static_cast<std::size_t>(parent)].name + " end", .parent = parent};
    end.offset = site.value_or(Eigen::Vector3d::Zero());
    site.reset();
    joints_.push_back(std::move(end));
    channels();
  }

  void channels() {
    static constexpr std::array<std::string_view, 6> names = {"Xposition", "Yposition", "Zposition",
                                                              "Xrotation", "Yrotation", "Zrotation"};
    if (!joint().channels.empty()) words_.fail("one CHANNELS line for joint \"" + joint().name + "\"");
    const auto count = words_.take_integer("a channel count of 0 to 6", 0, 6);
    for (std::int64_t i = 0; i < count; ++i) {
      const auto word = words_.peek();
      const auto found = std::ranges::find_if(names, [&](std::string_view name) { return same_word(name, word); });
      if (found == names.end()) words_.fail("one of Xposition ... Zposition, Xrotation ... Zrotation");
      const auto channel = static_cast<Channel>(found - names.begin());
      if (std::ranges::find(joint().channels, channel) != joint().channels.end()) {
        words_.fail("each channel of joint \"" + joint().name + "\" once");
      }
      joint().channels.push_back(channel);
      words_.skip(word);
    }
  }

  void close() {
    const int level = levels_.back();
    levels_.pop_back();
    if (level != end_site_level && !has_offset_[static_cast<std::size_t>(level)]) {
      words_.source().fail(words_.at(),
                           "joint \"" + joints_[static_cast<std::size_t>(level)].name + "\" without OFFSET",
                           "an OFFSET for every joint");
    }
  }

  HierarchyWords& words_;
  std::vector<Joint> joints_;
  std::vector<bool> has_offset_;
  std::vector<int> levels_;  // open braces, outermost first
};

// Only a leaf's end site means anything: elsewhere the children say where the bone goes.
void drop_inner_end_sites(Skeleton& skeleton) {
  for (const Joint& joint : skeleton.joints) {
    if (joint.parent >= 0) skeleton.joints[static_cast<std::size_t>(joint.parent)].end_site.reset();
  }
}

double rate_of_time(double frame_time) {
  const double rate = 1 / frame_time;
  const double whole = std::round(rate);
  return whole >= 1 && std::abs(frame_time * whole - 1) < 5e-5 ? whole : rate;
}

// The usual rate whose frame time, rounded to the decimals that `word` has, is `frame_time`; 0 when there is none.
double rate_before_rounding(std::string_view word, double frame_time) {
  const std::size_t point = word.find('.');
  const std::size_t decimals = point == std::string_view::npos ? 0 : word.size() - point - 1;
  if (decimals < 3 || decimals > 9 || !std::ranges::all_of(word.substr(point + 1), is_digit)) return 0;
  const double scale = std::pow(10.0, static_cast<double>(decimals));
  for (const double rate : {24.0, 25.0, 30.0, 50.0, 60.0, 72.0, 90.0, 100.0, 120.0, 240.0}) {
    if (std::round(scale / rate) == std::round(frame_time * scale)) return rate;
  }
  return 0;
}

// What a frame time means. Nobody records a frame in ten seconds: such a number is a rate.
double rate_of(std::string_view word, double frame_time, const std::string& file, const ClipReadOptions& options) {
  constexpr double slowest_s = 10, fastest_hz = 1000;
  const double rate = rate_of_time(frame_time);
  if (options.strict) return rate;
  const auto note = [&](double taken) {
    if (options.note) options.note(fmt::format("{}: frame time {} is taken for {:.6g} Hz", file, word, taken));
    return taken;
  };
  if (frame_time >= slowest_s && frame_time <= fastest_hz) return note(frame_time);
  const double meant = rate_before_rounding(word, frame_time);
  return meant > 0 && meant != rate ? note(meant) : rate;
}

void require_no_utf16(const TextSource& source) {
  const std::string_view start(source.begin(), std::min<std::size_t>(2, source.remaining(source.begin())));
  if (start == "\xff\xfe" || start == "\xfe\xff") {
    source.fail(source.begin(), "text in UTF-16", "ASCII or UTF-8", "save it as UTF-8");
  }
}

// "Frames:" and "Time:", with or without space around the colon.
void require_label(HierarchyWords& words, std::string_view label, const std::string& expected) {
  const auto word = words.peek();
  if (same_word(word, label)) {
    words.skip(word);
    words.require(":", expected);
    return;
  }
  const auto colon = word.find(':');
  if (colon == std::string_view::npos || !same_word(word.substr(0, colon), label)) words.fail(expected);
  words.skip(word.substr(0, colon + 1));
}

}  // namespace

BvhHeader parse_bvh_header(const TextSource& source, const ClipReadOptions& options) {
  require_no_utf16(source);
  HierarchyWords words(source);
  BvhHeader header;
  Hierarchy(words).parse(header);
  drop_inner_end_sites(header.skeleton);
  words.require("MOTION", "MOTION after the hierarchy");
  require_label(words, "Frames", "\"Frames:\" and the number of frames");
  header.frames = static_cast<int>(words.take_integer("a number of frames from 1 to 2147483647", options.strict ? 1 : 0,
                                                      std::numeric_limits<int>::max()));
  words.require("Frame", "\"Frame Time:\" and seconds");
  require_label(words, "Time", "\"Frame Time:\" and seconds");
  const std::string positive = "a frame time in seconds between 1e-6 and 1e6";
  const std::string_view word = words.peek();
  const char* const at = words.at();
  const double frame_time = words.take_number(positive);
  if (options.rate_hz) {
    header.rate_hz = *options.rate_hz;
  } else if (!(frame_time >= 1e-6 && frame_time <= 1e6)) {
    source.fail_at_word(at, positive, "say the rate (--rate)");
  } else {
    header.rate_hz = rate_of(word, frame_time, source.name(), options);
  }
  header.data = words.at();
  while (header.data != source.end() && is_blank(*header.data)) ++header.data;
  if (header.data == source.end() && source.remaining(header.data) > 0) source.fail_beyond_window();
  if (header.data != source.end() && !is_line_end(*header.data)) {
    source.fail_at_word(header.data, "the end of the line after the frame time");
  }
  return header;
}

}  // namespace kinespace
