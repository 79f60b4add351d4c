#include "kinespace/motion/bvh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
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

// Where a line stops being a row of numbers.
struct BadPlace {
  const char* at = nullptr;
  std::size_t column = 0;
};

[[noreturn]] void fail_in_row(const TextSource& source, const BadPlace& bad, std::size_t width) {
  if (bad.at == source.end() || is_line_end(*bad.at)) {
    source.fail(bad.at, std::to_string(bad.column) + " numbers in the line", std::to_string(width),
                bad.at == source.end() ? "the file is cut short" : "");
  }
  source.fail_at_word(bad.at, "a finite number between -1e9 and 1e9");
}

// "nan", as programs write it for what they have lost.
bool is_nan_word(std::string_view word) {
  if (word.starts_with('-') || word.starts_with('+')) word.remove_prefix(1);
  return same_word(word, "nan") || same_word(word, "nan(ind)") || same_word(word, "1.#ind") ||
         same_word(word, "1.#qnan");
}

// The numbers of one line into row `row` of the block. Returns the end of the line; null, with the place, at what is no
// number. `lost` is set where a number is "nan", if it may be.
const char* parse_row(const TextSource& source, const char* at, ColumnBlock& block, std::size_t width, int row,
                      BadPlace& bad, bool* lost) {
  const char* const end = source.end();
  double* out = block.data(0) + row;
  const int stride = block.rows();
  for (std::size_t column = 0; column < width; ++column, out += stride) {
    while (at != end && is_blank(*at)) ++at;
    const char* next = scan_number(at, end, *out);
    if (next == nullptr || !(next == end || is_space(*next)) || !(std::abs(*out) <= largest_number)) [[unlikely]] {
      const std::string_view word = word_at(at, end);
      if (lost == nullptr || !is_nan_word(word)) {
        bad = {at, column};
        return nullptr;
      }
      *lost = true;
      *out = 0;
      next = at + word.size();
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
  MotionParser(TextSource& source, BvhHeader header, std::string name, const ClipReadOptions& options)
      : source_(source),
        options_(options),
        at_(header.data),
        said_(header.frames),
        frames_(std::max(header.frames, 1)),
        width_(channel_count(header.skeleton)),
        layout_(lay_out(header.skeleton)),
        block_(width_) {
    if (width_ == 0) source.fail(at_, "a skeleton without channels", "channels of at least one joint");
    // Every number takes a digit and a separator: a count that the file cannot hold is found before it costs memory.
    const std::size_t possible = source.remaining(at_) / (2 * width_) + 1;
    if (static_cast<std::size_t>(frames_) > possible) {
      if (options_.strict) fail_count(0);
      frames_ = static_cast<int>(possible);
    }
    require_honest_size(source, header.skeleton.joints.size(), frames_);
    zeros_.assign(static_cast<std::size_t>(block_.rows()), 0);
    clip_ = make_clip(std::move(name), std::move(header.skeleton), header.rate_hz, frames_);
    for (const JointColumns& columns : layout_) {
      if (columns.has_position) translations_.emplace_back(columns.joint, frames_);
    }
  }

  Clip parse() && {
    while (next_line()) {
      if (rows_ == frames_) grow();
      const int row = rows_ % block_.rows();
      if (!read_row(row)) break;
      if (row + 1 < block_.rows()) continue;
      store(rows_ - block_.rows(), block_.rows());
      keep_last_row();
    }
    if (rows_ == 0 && said_ > 0) fail_count(0);
    if (const int rest = rows_ % block_.rows(); rest != 0) store(rows_ - rest, rest);
    note_lost();
    if (rows_ != said_ || rows_ == 0) count_is_wrong();
    if (rows_ < frames_) clip_ = slice(clip_, 0, std::max(rows_, 1));
    finish_translations(std::move(translations_), clip_);
    return std::move(clip_);
  }

 private:
  void note(const std::string& what) const {
    if (options_.note) options_.note(source_.name() + ": " + what);
  }

  void count_is_wrong() {
    if (options_.strict) fail_count(rows_);
    if (said_ == 0 && rows_ == 0) return note("no frames; the rest pose is read, one frame");
    note(std::to_string(rows_) + " whole frames of data, not " + std::to_string(said_) +
         " as \"Frames:\" says: " + (rows_ < said_ ? "there are no more" : "all are read"));
  }

  // Room for more frames than there was to be.
  void grow() {
    if (options_.strict) fail_count(rows_);
    const auto possible = static_cast<std::int64_t>(source_.remaining(at_) / (2 * width_) + 1);
    const std::int64_t wanted = std::min<std::int64_t>(rows_ + std::min<std::int64_t>(possible, std::max(rows_, 256)),
                                                       std::numeric_limits<int>::max());
    if (wanted <= rows_) source_.fail(at_, "more frames than can be counted", "at most 2147483647");
    require_honest_size(source_, clip_.skeleton.joints.size(), wanted);
    Clip larger = make_clip(clip_.name, clip_.skeleton, clip_.rate_hz, static_cast<int>(wanted));
    for (int j = 0; j < clip_.skeleton.joint_count(); ++j) {
      std::ranges::copy(clip_.rotation_track(j), larger.rotation_track(j).begin());
    }
    clip_ = std::move(larger);
    frames_ = static_cast<int>(wanted);
  }

  // Into row `row` of the block. False where the file ends within the line, which is left out then.
  bool read_row(int row) {
    BadPlace bad;
    bool lost = false;
    const char* const end = parse_row(source_, at_, block_, width_, row, bad, options_.strict ? nullptr : &lost);
    if (end == nullptr) {
      if (options_.strict || rows_ == 0 || !ends_within(bad)) fail_in_row(source_, bad, width_);
      note("the last line is cut short and left out");
      return false;
    }
    at_ = end;
    if (lost) {
      hold(row);
    } else {
      end_lost();
      if (!begun_) begin_with(row);
    }
    ++rows_;
    return true;
  }

  // Whether nothing follows what is cut: the word that is no number ends the text, or the line does.
  bool ends_within(const BadPlace& bad) {
    const char* rest = bad.at + word_at(bad.at, source_.end()).size();
    if (rest != bad.at && rest != source_.end()) return false;
    while (rest != source_.end() && is_space(*rest)) ++rest;
    return source_.remaining(rest) == 0;
  }

  // What a lost frame's row holds: the one before, once there is one.
  void hold(int row) {
    if (lost_from_ < 0) lost_from_ = rows_;
    ++lost_;
    if (!begun_) return;
    for (std::size_t c = 0; c < width_; ++c) block_.data(c)[row] = row > 0 ? block_.data(c)[row - 1] : last_[c];
  }

  // The first frame that is there stands for lost ones before it, too.
  void begin_with(int row) {
    begun_ = true;
    if (rows_ > row) source_.fail(at_, std::to_string(rows_) + " lost frames", "a first frame that is there");
    for (std::size_t c = 0; c < width_; ++c) std::fill_n(block_.data(c), row, block_.data(c)[row]);
  }

  void keep_last_row() {
    last_.resize(width_);
    for (std::size_t c = 0; c < width_; ++c) last_[c] = block_.data(c)[block_.rows() - 1];
  }

  void end_lost() {
    if (lost_from_ < 0) return;
    if (options_.lost) options_.lost(lost_from_, rows_ - 1);
    lost_from_ = -1;
    ++gaps_;
  }

  void note_lost() {
    if (rows_ > 0 && !begun_) source_.fail(at_, "nothing but lost frames", "numbers");
    end_lost();
    if (lost_ == 0) return;
    note(std::to_string(lost_) + " lost frames (nan) in " + std::to_string(gaps_) + (gaps_ == 1 ? " gap" : " gaps") +
         ": the frame before stands there");
  }

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
    const bool short_of = found < said_;
    source_.fail_in_line(short_of ? source_.line_of(at_) : line,
                         std::to_string(found) + (found == 1 ? " frame" : " frames") + " of data",
                         std::to_string(said_) + " as \"Frames:\" says",
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
  const ClipReadOptions& options_;
  const char* at_;
  int said_;                  // as "Frames:" has it
  int frames_;                // that there is room for
  int rows_ = 0;              // that have been read
  bool begun_ = false;        // a frame that is there has been read
  int lost_from_ = -1;        // the first of the lost frames that the reader is in
  int lost_ = 0, gaps_ = 0;   // in all
  std::vector<double> last_;  // the last row of the block before
  std::size_t width_;
  std::vector<JointColumns> layout_;
  ColumnBlock block_;
  std::vector<double> zeros_;
  Clip clip_;
  std::vector<TranslationBuilder> translations_;
};

// Joints [first, end) of a clip that has several roots, as the clip NAME.number.
Clip tree_of(const Clip& all, int first, int end, int number) {
  Skeleton skeleton;
  for (int j = first; j < end; ++j) {
    Joint joint = all.skeleton.joints[static_cast<std::size_t>(j)];
    if (joint.parent >= 0) joint.parent -= first;
    skeleton.joints.push_back(std::move(joint));
  }
  Clip out = make_clip(all.name + "." + std::to_string(number), std::move(skeleton), all.rate_hz, all.frames);
  for (int j = first; j < end; ++j) std::ranges::copy(all.rotation_track(j), out.rotation_track(j - first).begin());
  for (const Clip::TranslationTrack& track : all.translations) {
    if (track.joint >= first && track.joint < end) out.translations.push_back({track.joint - first, track.values});
  }
  return out;
}

// By the number, or the name of the root.
std::vector<Clip> chosen_tree(std::vector<Clip> trees, const std::string& file, const ClipReadOptions& options,
                              ClipsWanted wanted) {
  if (trees.size() == 1 && (options.animation.empty() || options.animation == "1")) return trees;
  if (options.animation.empty() && wanted == ClipsWanted::all) return trees;
  std::size_t which = 0;
  if (options.animation.empty()) {
    if (options.note) {
      options.note(file + ": the first of " + std::to_string(trees.size()) +
                   " skeletons is read; --animation takes another by the name of its ROOT or its number");
    }
  } else {
    for (which = 0; which < trees.size(); ++which) {
      const bool named = trees[which].skeleton.joints.front().name == options.animation;
      if (named || std::to_string(which + 1) == options.animation) break;
    }
    if (which == trees.size()) {
      throw Error(ErrorKind::bad_input, {.file = file,
                                         .found = "no skeleton \"" + options.animation + "\"",
                                         .expected = trees.size() == 1 ? "nothing: it holds one clip"
                                                                       : "the name of a ROOT, or a number from 1 to " +
                                                                             std::to_string(trees.size()),
                                         .remedy = trees.size() == 1 ? "leave --animation out" : ""});
    }
  }
  std::vector<Clip> out;
  out.push_back(std::move(trees[which]));
  return out;
}

}  // namespace

std::vector<Clip> parse_bvh(TextSource& source, const ClipReadOptions& options) {
  BvhHeader header = parse_bvh_header(source, options);
  const std::vector<int> roots = header.roots;
  Clip all =
      MotionParser(source, std::move(header), std::filesystem::path(source.name()).stem().string(), options).parse();
  std::vector<Clip> out;
  if (roots.size() == 1) {
    out.push_back(std::move(all));
    return out;
  }
  for (std::size_t r = 0; r < roots.size(); ++r) {
    const int end = r + 1 < roots.size() ? roots[r + 1] : all.skeleton.joint_count();
    out.push_back(tree_of(all, roots[r], end, static_cast<int>(r) + 1));
  }
  return out;
}

Clip parse_bvh(std::string_view text, const std::string& source_name, const ClipReadOptions& options) {
  TextSource source(text, source_name);
  return std::move(chosen_tree(parse_bvh(source, options), source_name, options, ClipsWanted::one).front());
}

std::vector<Clip> read_bvh(const std::filesystem::path& path, const ClipReadOptions& options, ClipsWanted wanted) {
  TextSource source(path);
  return chosen_tree(parse_bvh(source, options), path.string(), options, wanted);
}

Clip read_bvh(const std::filesystem::path& path) {
  return std::move(read_bvh(path, {}, ClipsWanted::one).front());
}

std::vector<std::string> bvh_clips(const std::filesystem::path& path) {
  const TextSource source(path);
  const std::size_t roots = parse_bvh_header(source, {}).roots.size();
  std::vector<std::string> out;
  for (std::size_t r = 1; r <= roots; ++r) out.push_back(std::to_string(r));
  return out;
}

namespace {

using JointChannels = std::vector<std::vector<Channel>>;  // by joint

std::string safe_name(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool forbidden = c == '{' || c == '}' || (static_cast<unsigned char>(c) < 0x20) || c == 0x7f;
    out += forbidden ? '_' : c;
  }
  const bool only_space = std::ranges::all_of(out, [](char c) { return c == ' '; });
  return only_space ? "_" : out;
}

class HierarchyWriter {
 public:
  HierarchyWriter(const Skeleton& skeleton, const JointChannels& channels, std::string& out)
      : skeleton_(skeleton), channels_(channels), out_(out), leaf_(skeleton.joints.size(), true) {
    for (const Joint& joint : skeleton.joints) {
      if (joint.parent >= 0) leaf_[static_cast<std::size_t>(joint.parent)] = false;
    }
  }

  // Joints stand in the order of a walk through the tree: that is the order of the file's columns.
  void write(const std::vector<int>& walk) {
    out_ += "HIERARCHY\n";
    std::vector<int> open;
    for (const int j : walk) {
      const Joint& joint = skeleton_.joints[static_cast<std::size_t>(j)];
      while (!open.empty() && open.back() != joint.parent) close(open);
      line(open.size(), joint.parent < 0 ? "ROOT " : "JOINT ", safe_name(joint.name));
      open.push_back(j);
      begin_body(j, open.size());
    }
    while (!open.empty()) close(open);
  }

 private:
  void indent(std::size_t depth) { out_.append(2 * depth, ' '); }
  void line(std::size_t depth, const char* word, const std::string& rest) {
    indent(depth);
    out_ += word;
    out_ += rest;
    out_ += '\n';
  }
  void offset(std::size_t depth, const Eigen::Vector3d& value) {
    indent(depth);
    out_ += "OFFSET";
    for (const double x : value) {
      out_ += ' ';
      append_exact(out_, x);
    }
    out_ += '\n';
  }
  void begin_body(int j, std::size_t depth) {
    static constexpr std::array<const char*, 6> names = {" Xposition", " Yposition", " Zposition",
                                                         " Xrotation", " Yrotation", " Zrotation"};
    const auto index = static_cast<std::size_t>(j);
    line(depth - 1, "{", "");
    offset(depth, skeleton_.joints[index].offset);
    std::string list = std::to_string(channels_[index].size());
    for (const Channel c : channels_[index]) list += names[static_cast<std::size_t>(c)];
    line(depth, "CHANNELS ", list);
    if (!leaf_[index]) return;
    line(depth, "End Site", "");
    line(depth, "{", "");
    offset(depth + 1, skeleton_.joints[index].end_site.value_or(Eigen::Vector3d::Zero()));
    line(depth, "}", "");
  }
  void close(std::vector<int>& open) {
    open.pop_back();
    line(open.size(), "}", "");
  }

  const Skeleton& skeleton_;
  const JointChannels& channels_;
  std::string& out_;
  std::vector<bool> leaf_;
};

// Depth first, children in their order. The same as the skeleton's own order when that came from a BVH.
std::vector<int> depth_first(const Skeleton& skeleton) {
  std::vector<std::vector<int>> children(skeleton.joints.size());
  for (int j = 1; j < skeleton.joint_count(); ++j) {
    children[static_cast<std::size_t>(skeleton.joints[static_cast<std::size_t>(j)].parent)].push_back(j);
  }
  std::vector<int> walk;
  std::vector<int> pending = {0};
  while (!pending.empty()) {
    const int j = pending.back();
    pending.pop_back();
    walk.push_back(j);
    const auto& below = children[static_cast<std::size_t>(j)];
    pending.insert(pending.end(), below.rbegin(), below.rend());
  }
  return walk;
}

class MotionWriter {
 public:
  MotionWriter(const Clip& clip, const JointChannels& channels, const std::vector<int>& walk)
      : clip_(clip),
        channels_(channels),
        walk_(walk),
        width_(count(channels)),
        block_(width_),
        near_(channels.size()),
        columns_(3 * static_cast<std::size_t>(block_.rows())) {}

  void write(const FileSink& sink) {
    std::string out;  // of a block
    for (int first = 0; first < clip_.frames; first += block_.rows()) {
      out.clear();
      const int some = std::min(block_.rows(), clip_.frames - first);
      fill(first, some);
      for (int row = 0; row < some; ++row) {
        for (std::size_t c = 0; c < width_; ++c) {
          if (c > 0) out += ' ';
          append_fixed(out, block_.data(c)[row]);
        }
        out += '\n';
      }
      sink(out);
    }
  }

 private:
  static std::size_t count(const JointChannels& channels) {
    std::size_t sum = 0;
    for (const auto& list : channels) sum += list.size();
    return sum;
  }

  void fill(int first, int some) {
    std::size_t column = 0;
    for (const int j : walk_) {
      const auto& channels = channels_[static_cast<std::size_t>(j)];
      EulerOrder order = euler_order(channels);
      euler_columns(clip_, j, order, first, some, columns_.data(), block_.rows(), near_[static_cast<std::size_t>(j)],
                    first > 0);
      const Clip::TranslationTrack* track = clip_.translation_track(j);
      const Eigen::Vector3d& offset = clip_.skeleton.joints[static_cast<std::size_t>(j)].offset;
      const double* angles = columns_.data();
      for (const Channel c : channels) {
        double* out = block_.data(column++);
        if (is_position(c)) {
          for (int f = 0; f < some; ++f) {
            out[f] = (track != nullptr ? track->values[static_cast<std::size_t>(first) + static_cast<std::size_t>(f)]
                                       : offset)[axis_of(c)];
          }
        } else {
          std::copy_n(angles, some, out);
          angles += block_.rows();
        }
      }
    }
  }

  const Clip& clip_;
  const JointChannels& channels_;
  const std::vector<int>& walk_;
  std::size_t width_;
  ColumnBlock block_;
  std::vector<EulerAngles> near_;
  std::vector<double> columns_;
};

// A clip on its way into a file: what stands before the numbers, and then those.
class BvhText {
 public:
  explicit BvhText(const Clip& clip) : clip_(clip), walk_(depth_first(clip.skeleton)) {
    for (int j = 0; j < clip.skeleton.joint_count(); ++j) channels_.push_back(channels_to_write(clip, j));
    // A file without a single number a frame could not be read back.
    if (std::ranges::all_of(channels_, &std::vector<Channel>::empty)) channels_[0] = {Channel::y_rotation};
  }

  [[nodiscard]] std::string head() const {
    std::string out;
    HierarchyWriter(clip_.skeleton, channels_, out).write(walk_);
    out += "MOTION\nFrames: " + std::to_string(clip_.frames) + "\nFrame Time: ";
    append_exact(out, 1 / clip_.rate_hz);
    out += '\n';
    return out;
  }
  void write_motion(const FileSink& sink) const { MotionWriter(clip_, channels_, walk_).write(sink); }

 private:
  const Clip& clip_;
  std::vector<int> walk_;
  JointChannels channels_;
};

}  // namespace

std::string format_bvh(const Clip& clip) {
  const BvhText text(clip);
  std::string out = text.head();
  text.write_motion([&](std::string_view piece) { out += piece; });
  return out;
}

void write_bvh(const std::filesystem::path& path, const Clip& clip) {
  const BvhText text(clip);
  const std::string head = text.head();
  const FileToWrite file{path, head, [&](const FileSink& sink) { text.write_motion(sink); }};
  write_files_atomically(std::span(&file, 1));
}

}  // namespace kinespace
