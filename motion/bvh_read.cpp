#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "kinespace/base/file.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/detail/bvh_hierarchy.h"
#include "kinespace/motion/detail/motion_builder.h"
#include "kinespace/motion/euler.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

// Where a joint's channels stand in a line.
struct JointColumns {
  int joint = 0;
  EulerOrder order;
  std::array<int, 3> rotation = {-1, -1, -1};  // in channel order
  std::array<int, 3> position = {-1, -1, -1};  // by axis
  bool has_position = false;
};

std::vector<JointColumns> lay_out(const Skeleton& skeleton) {
  std::vector<JointColumns> out;
  int column = 0;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const Joint& joint = skeleton.joints[static_cast<std::size_t>(j)];
    JointColumns columns{.joint = j, .order = euler_order(joint.channels), .has_position = joint.has_position()};
    std::size_t rotations = 0;
    for (const Channel c : joint.channels) {
      (is_position(c) ? columns.position[static_cast<std::size_t>(axis_of(c))] : columns.rotation[rotations++]) =
          column++;
    }
    if (!joint.channels.empty()) out.push_back(columns);
  }
  return out;
}

std::size_t channel_count(const Skeleton& skeleton) {
  std::size_t count = 0;
  for (const Joint& joint : skeleton.joints) count += joint.channels.size();
  return count;
}

[[noreturn]] void fail_in_row(const TextSource& source, const char* at, std::size_t column, std::size_t width) {
  if (at == source.end() || is_line_end(*at)) {
    source.fail(at, std::to_string(column) + " numbers in the line", std::to_string(width),
                at == source.end() ? "the file is cut short" : "");
  }
  source.fail_at_word(at, "a finite number between -1e9 and 1e9");
}

// The numbers of one line into row `row` of the block. Returns the end of the line.
const char* parse_row(const TextSource& source, const char* at, ColumnBlock& block, std::size_t width, int row) {
  const char* const end = source.end();
  double* out = block.data(0) + row;
  const int stride = block.rows();
  for (std::size_t column = 0; column < width; ++column, out += stride) {
    while (at != end && is_blank(*at)) ++at;
    const char* const next = scan_number(at, end, *out);
    if (next == nullptr || !(next == end || is_space(*next)) || !(std::abs(*out) <= largest_number)) [[unlikely]] {
      fail_in_row(source, at, column, width);
    }
    at = next;
  }
  while (at != end && is_blank(*at)) ++at;
  if (at != end && !is_line_end(*at)) {
    source.fail(at, "more than " + std::to_string(width) + " numbers in the line",
                std::to_string(width) + ", one for each channel of the hierarchy");
  }
  return at;
}

class MotionParser {
 public:
  MotionParser(TextSource& source, BvhHeader header, std::string name)
      : source_(source),
        at_(header.data),
        frames_(header.frames),
        width_(channel_count(header.skeleton)),
        layout_(lay_out(header.skeleton)),
        block_(width_) {
    if (width_ == 0) source.fail(at_, "a skeleton without channels", "channels of at least one joint");
    // Every number takes a digit and a separator: a count that the file cannot hold is found before it costs memory.
    if (static_cast<std::size_t>(frames_) > source.remaining(at_) / (2 * width_) + 1) fail_count(0);
    require_honest_size(source, header.skeleton.joints.size(), frames_);
    zeros_.assign(static_cast<std::size_t>(block_.rows()), 0);
    clip_ = make_clip(std::move(name), std::move(header.skeleton), header.rate_hz, frames_);
    for (const JointColumns& columns : layout_) {
      if (columns.has_position) translations_.emplace_back(columns.joint, frames_);
    }
  }

  Clip parse() && {
    for (int first = 0; first < frames_; first += block_.rows()) {
      const int count = std::min(block_.rows(), frames_ - first);
      for (int row = 0; row < count; ++row) {
        if (!next_line()) fail_count(first + row);
        at_ = parse_row(source_, at_, block_, width_, row);
      }
      store(first, count);
    }
    if (next_line()) fail_count(frames_);
    finish_translations(std::move(translations_), clip_);
    return std::move(clip_);
  }

 private:
  // Goes to the next line with something in it, all of which is in hand then; false at the end.
  bool next_line() {
    do {
      while (at_ != source_.end() && is_space(*at_)) ++at_;
    } while (at_ == source_.end() && source_.more(at_));
    if (at_ == source_.end()) return false;
    source_.hold_line(at_);
    return true;
  }

  // After so many frames: with the lines from here on there are too few or too many.
  [[noreturn]] void fail_count(std::int64_t before) {
    const std::int64_t line = source_.line_of(at_);
    const std::int64_t found = before + count_lines();
    const bool short_of = found < frames_;
    source_.fail_in_line(short_of ? source_.line_of(at_) : line,
                         std::to_string(found) + (found == 1 ? " frame" : " frames") + " of data",
                         std::to_string(frames_) + " as \"Frames:\" says",
                         short_of ? "the file is cut short" : "correct the frame count");
  }

  // Lines with something in them, from here on.
  [[nodiscard]] std::int64_t count_lines() {
    std::int64_t lines = 0;
    bool blank = true;
    do {
      for (; at_ != source_.end(); ++at_) {
        if (is_line_end(*at_)) {
          blank = true;
        } else if (blank && !is_blank(*at_)) {
          blank = false;
          ++lines;
        }
      }
    } while (source_.more(at_));
    return lines;
  }

  const double* column(int index) const {
    return index < 0 ? zeros_.data() : block_.data(static_cast<std::size_t>(index));
  }

  void store(int first, int count) {
    auto translation = translations_.begin();
    for (const JointColumns& columns : layout_) {
      if (columns.order.given > 0) {
        quaternions_from_euler(columns.order, column(columns.rotation[0]), column(columns.rotation[1]),
                               column(columns.rotation[2]), count,
                               clip_.rotation_track(columns.joint).data() + static_cast<std::size_t>(first) * 4);
      }
      if (!columns.has_position) continue;
      const std::array<const double*, 3> at = {column(columns.position[0]), column(columns.position[1]),
                                               column(columns.position[2])};
      for (int f = 0; f < count; ++f) translation->append({at[0][f], at[1][f], at[2][f]});
      ++translation;
    }
  }

  TextSource& source_;
  const char* at_;
  int frames_;
  std::size_t width_;
  std::vector<JointColumns> layout_;
  ColumnBlock block_;
  std::vector<double> zeros_;
  Clip clip_;
  std::vector<TranslationBuilder> translations_;
};

}  // namespace

Clip parse_bvh(TextSource& source) {
  return MotionParser(source, parse_bvh_header(source), std::filesystem::path(source.name()).stem().string()).parse();
}

Clip parse_bvh(std::string_view text, const std::string& source_name) {
  TextSource source(text, source_name);
  return parse_bvh(source);
}

Clip read_bvh(const std::filesystem::path& path) {
  TextSource source(path);
  return parse_bvh(source);
}

}  // namespace kinespace
