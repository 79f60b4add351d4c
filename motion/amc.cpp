#include "kinespace/motion/amc.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "kinespace/base/file.h"
#include "kinespace/motion/detail/motion_builder.h"
#include "kinespace/motion/euler.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

constexpr double usual_rate_hz = 120;

// Where a joint's values stand among all values of a frame, by axis; -1 for what its dofs leave out.
struct BoneColumns {
  int joint = 0;
  std::size_t first = 0;
  std::array<int, 3> rotation = {-1, -1, -1};
  std::array<int, 3> position = {-1, -1, -1};
  bool rotates = false;
  bool moves = false;
};

std::vector<BoneColumns> lay_out(const Asf& asf) {
  std::vector<BoneColumns> out;
  int column = 0;
  for (std::size_t j = 0; j < asf.bones.size(); ++j) {
    BoneColumns columns{.joint = static_cast<int>(j), .first = static_cast<std::size_t>(column)};
    for (const Channel c : asf.bones[j].dofs) {
      (is_position(c) ? columns.position : columns.rotation)[static_cast<std::size_t>(axis_of(c))] = column++;
      (is_position(c) ? columns.moves : columns.rotates) = true;
    }
    out.push_back(columns);
  }
  return out;
}

std::size_t dof_count(const Asf& asf) {
  std::size_t count = 0;
  for (const auto& bone : asf.bones) count += bone.dofs.size();
  return count;
}

// q -> C q C^-1: the vector part turns, the scalar part stays.
void turn_axes(const Eigen::Quaterniond& c, double* wxyz, int count) {
  const Eigen::Matrix3d m = c.toRotationMatrix();
  for (int f = 0; f < count; ++f, wxyz += 4) {
    const double x = wxyz[1], y = wxyz[2], z = wxyz[3];
    wxyz[1] = m(0, 0) * x + m(0, 1) * y + m(0, 2) * z;
    wxyz[2] = m(1, 0) * x + m(1, 1) * y + m(1, 2) * z;
    wxyz[3] = m(2, 0) * x + m(2, 1) * y + m(2, 2) * z;
  }
}

class AmcParser {
 public:
  AmcParser(const TextSource& source, const Asf& asf, std::string name, const ClipReadOptions& options)
      : source_(source),
        asf_(asf),
        options_(options),
        at_(source.begin()),
        radians_(asf.radians),
        layout_(lay_out(asf)),
        block_(dof_count(asf)),
        follows_(asf.bones.size() + 1, 0),
        seen_in_(asf.bones.size(), -1),
        zeros_(static_cast<std::size_t>(block_.rows()), 0) {
    for (std::size_t j = 0; j < asf.bones.size(); ++j) {
      joint_of_.emplace(asf.skeleton.joints[j].name, static_cast<int>(j));
      if (!asf.bones[j].dofs.empty()) ++wanted_;
    }
    read_head();
    const FrameLines lines = frame_lines();
    const std::int64_t frames = options.strict ? honest_frames(lines) : numbered_frames(lines);
    require_honest_size(source, asf.bones.size(), frames);
    clip_ = make_clip(std::move(name), asf.skeleton, rate_of_clip(), static_cast<int>(frames));
    for (const BoneColumns& columns : layout_) {
      if (columns.moves) translations_.emplace_back(columns.joint, clip_.frames);
    }
  }

  Clip parse() && {
    int frame = 0;
    while (next_line()) {
      const std::int64_t missing = frame_number(frame);
      if (frame + missing >= clip_.frames) source_.fail(at_, "line ends of several kinds", "the same in all lines");
      if (missing > 0 && options_.lost) options_.lost(frame, frame + static_cast<int>(missing) - 1);
      for (std::int64_t i = 0; i < missing; ++i, ++frame) {
        hold(frame % block_.rows());
        end_frame(frame);
      }
      read_frame(frame);
      end_frame(frame++);
    }
    finish_translations(std::move(translations_), clip_);
    return std::move(clip_);
  }

 private:
  // Goes to the next line that is neither empty nor a comment nor a keyword; false at the end.
  bool next_line() {
    for (;;) {
      while (at_ != source_.end() && is_space(*at_)) ++at_;
      if (at_ == source_.end()) return false;
      if (*at_ != '#' && *at_ != ':') return true;
      if (*at_ == ':') keyword();
      while (at_ != source_.end() && !is_line_end(*at_)) ++at_;
    }
  }

  void keyword() {
    const auto word = word_at(at_, source_.end());
    if (same_word(word, ":radians")) radians_ = true;
    if (same_word(word, ":degrees")) radians_ = false;
    if (!same_word(word, ":samples-per-second")) return;
    const char* value = word.data() + word.size();
    while (value != source_.end() && is_blank(*value)) ++value;
    const char* const stop = scan_number(value, source_.end(), rate_hz_);
    if (stop == nullptr || (stop != source_.end() && !is_space(*stop)) || !(rate_hz_ >= 1e-6 && rate_hz_ <= 1e6)) {
      source_.fail_at_word(value, "a rate between 1e-6 and 1e6 samples a second");
    }
  }

  void read_head() {
    if (!next_line()) source_.fail(at_, "no frame", "at least one frame", "check that this is an AMC file");
  }

  // True at a word of digits with nothing else in its line.
  [[nodiscard]] bool is_frame_line(const char* p) const {
    const char* const digits = p;
    while (p != source_.end() && is_digit(*p)) ++p;
    if (p == digits) return false;
    while (p != source_.end() && is_blank(*p)) ++p;
    return p == source_.end() || is_line_end(*p);
  }

  // The lines from here on that hold a frame's number. memchr finds line ends several times as fast as a loop; a file
  // without LF has CR alone.
  struct FrameLines {
    std::int64_t count = 0;
    std::int64_t first = -1, last = -1;  // numbers
    std::int64_t least = 0, most = 0;    // steps from one to the next
  };
  [[nodiscard]] FrameLines frame_lines() const {
    FrameLines out;
    for_each_frame_line([&](const char* at) {
      ++out.count;
      std::int64_t number = 0;
      const auto [stop, code] = std::from_chars(at, source_.end(), number);
      if (code != std::errc()) number = out.last;  // told when it is read
      if (out.count == 1) {
        out.first = number;
      } else {
        const std::int64_t step = number - out.last;
        out.least = out.count == 2 ? step : std::min(out.least, step);
        out.most = out.count == 2 ? step : std::max(out.most, step);
      }
      out.last = number;
    });
    return out;
  }
  template <typename Visit>
  void for_each_frame_line(const Visit& visit) const {
    const char* const end = source_.end();
    const auto find = [end](const char* from, char c) {
      const void* const found = from == end ? nullptr : std::memchr(from, c, static_cast<std::size_t>(end - from));
      return found != nullptr ? static_cast<const char*>(found) : end;
    };
    const char line_end = find(at_, '\n') != end ? '\n' : '\r';
    for (const char* p = at_; p != end; p = find(p, line_end)) {
      while (p != end && is_space(*p)) ++p;
      if (p != end && is_digit(*p) && is_frame_line(p)) visit(p);
    }
  }

  // How many frames to make room for: no more than the file can hold, whatever it claims. A file with more frame lines
  // than that lacks bones in some frame, which is found when that frame is read.
  [[nodiscard]] std::int64_t honest_frames(const FrameLines& lines) const {
    std::size_t least =
        2;  // bytes of the shortest frame: its number, and for each bone the name, the values, a line end
    for (std::size_t j = 0; j < asf_.bones.size(); ++j) {
      if (!asf_.bones[j].dofs.empty()) least += asf_.skeleton.joints[j].name.size() + 2 * asf_.bones[j].dofs.size() + 1;
    }
    const auto possible = static_cast<std::int64_t>(source_.size() / least + 1);
    return std::clamp<std::int64_t>(lines.count, 1, std::min<std::int64_t>(possible, std::numeric_limits<int>::max()));
  }

  // Stores the block when it is full.
  void end_frame(int frame) {
    const int row = frame % block_.rows();
    if (row + 1 < block_.rows() && frame + 1 < clip_.frames) return;
    last_.resize(dof_count(asf_));
    for (std::size_t c = 0; c < last_.size(); ++c) last_[c] = block_.data(c)[row];
    store(frame - row, row + 1);
  }

  // A frame that is not there: the one before it.
  void hold(int row) {
    const std::size_t columns = dof_count(asf_);
    for (std::size_t c = 0; c < columns; ++c) block_.data(c)[row] = row > 0 ? block_.data(c)[row - 1] : last_[c];
  }

  // How the numbers of frames go up, before any frame is read: by a step of their own, or with gaps. Where they do
  // neither, reading finds the place.
  std::int64_t numbered_frames(const FrameLines& of_file) {
    const std::int64_t lines = honest_frames(of_file);
    const auto& [count, first, last, least, most] = of_file;
    if (least < 1 || (least == 1 && most == 1)) return lines;
    step_ = least;
    if (least == most) {
      note(fmt::format("frame numbers go up by {}: the clip is at {:.6g} Hz, not {:.6g}", least, rate_of_clip(),
                       rate_hz_));
      return lines;
    }
    // A number that is damaged is no gap.
    constexpr std::int64_t most_a_frame = 64, always = 1000;
    const std::int64_t all = (last - first) / least + 1;
    gaps_ = all > lines && all <= most_a_frame * lines + always && all <= std::numeric_limits<int>::max();
    if (gaps_) {
      note(fmt::format("{} frames are not there, by the frame numbers: the frame before stands there", all - lines));
      return all;
    }
    return lines;
  }

  void note(const std::string& what) const {
    if (options_.note) options_.note(source_.name() + ": " + what);
  }

  [[nodiscard]] double rate_of_clip() const { return options_.rate_hz.value_or(rate_hz_ / static_cast<double>(step_)); }

  void read_frame(int frame) {
    int previous = 0;  // 0: the line of the frame number; else the joint of the line before, plus one
    std::size_t found = 0;
    while (next_line() && !at_frame_number()) {
      const int joint = joint_at(previous);
      if (std::exchange(seen_in_[static_cast<std::size_t>(joint)], frame) == frame) {
        source_.fail_at_word(at_, "each bone once a frame");
      }
      read_values(joint, frame % block_.rows());
      if (!asf_.bones[static_cast<std::size_t>(joint)].dofs.empty()) ++found;
      previous = joint + 1;
    }
    if (found < wanted_) fail_missing(frame);
  }

  // A frame's number stands alone; a bone's name may start with a digit.
  [[nodiscard]] bool at_frame_number() const {
    return is_digit(*at_) && std::ranges::all_of(word_at(at_, source_.end()), is_digit);
  }

  // How many frames are left out before it.
  std::int64_t frame_number(int frame) {
    std::int64_t number = 0;
    const auto word = word_at(at_, source_.end());
    const auto [stop, code] = std::from_chars(word.data(), word.data() + word.size(), number);
    const char* rest = stop;
    while (rest != source_.end() && is_blank(*rest)) ++rest;
    if (code != std::errc() || stop != word.data() + word.size() || (rest != source_.end() && !is_line_end(*rest))) {
      source_.fail_at_word(at_, "a frame number on a line of its own");
    }
    const std::int64_t steps = frame == 0 ? 1 : (number - number_) / step_;
    const bool whole = frame == 0 || (number > number_ && (number - number_) % step_ == 0);
    if (!whole || (!gaps_ && steps != 1)) {
      source_.fail_at_word(at_, "frame number " + std::to_string(number_ + step_), "the file has lost frames");
    }
    number_ = number;
    at_ = rest;
    return steps - 1;
  }

  // The joint named at the start of the line. Files list bones in the same order in every frame: try that first.
  int joint_at(int previous) {
    int& guess = follows_[static_cast<std::size_t>(previous)];
    const std::string& name = asf_.skeleton.joints[static_cast<std::size_t>(guess)].name;
    const auto left = static_cast<std::size_t>(source_.end() - at_);
    if (left > name.size() && std::string_view(at_, name.size()) == name && is_space(at_[name.size()])) return guess;
    const auto word = word_at(at_, source_.end());
    const auto found = joint_of_.find(word);
    if (found == joint_of_.end()) {
      source_.fail_at_word(at_, "a bone of the ASF file", "check that the ASF file belongs to this motion");
    }
    return guess = found->second;
  }

  void read_values(int joint, int row) {
    const char* const end = source_.end();
    const Joint& named = asf_.skeleton.joints[static_cast<std::size_t>(joint)];
    const std::size_t count = asf_.bones[static_cast<std::size_t>(joint)].dofs.size();
    const char* at = at_ + named.name.size();
    double* out = block_.data(layout_[static_cast<std::size_t>(joint)].first) + row;
    for (std::size_t i = 0; i < count; ++i, out += block_.rows()) {
      while (at != end && is_blank(*at)) ++at;
      const char* const next = scan_number(at, end, *out);
      if (next == nullptr || !(next == end || is_space(*next)) || !(std::abs(*out) <= largest_number)) [[unlikely]] {
        fail_in_values(at, named.name, i, count);
      }
      at = next;
    }
    while (at != end && is_blank(*at)) ++at;
    if (at != end && !is_line_end(*at)) fail_in_values(at, named.name, count + 1, count);
    at_ = at;
  }

  [[noreturn]] void fail_in_values(const char* at, const std::string& name, std::size_t found,
                                   std::size_t wanted) const {
    const bool short_line = at == source_.end() || is_line_end(*at);
    if (!short_line && found <= wanted) source_.fail_at_word(at, "a finite number between -1e9 and 1e9");
    source_.fail(at,
                 short_line ? std::to_string(found) + " values of bone \"" + name + "\""
                            : "more than " + std::to_string(wanted) + " values of bone \"" + name + "\"",
                 std::to_string(wanted) + ", one for each dof of the ASF file",
                 at == source_.end() ? "the file is cut short" : "");
  }

  [[noreturn]] void fail_missing(int frame) const {
    std::size_t j = 0;
    while (asf_.bones[j].dofs.empty() || seen_in_[j] == frame) ++j;
    source_.fail(at_, "no values of bone \"" + asf_.skeleton.joints[j].name + "\" in frame " + std::to_string(number_),
                 "all bones with dofs in every frame", at_ == source_.end() ? "the file is cut short" : "");
  }

  const double* column(int index) const {
    return index < 0 ? zeros_.data() : block_.data(static_cast<std::size_t>(index));
  }

  void store(int first, int count) {
    auto translation = translations_.begin();
    for (const BoneColumns& columns : layout_) {
      if (columns.rotates) store_rotations(columns, first, count);
      if (columns.moves) store_translations(columns, *translation++, count);
    }
  }

  void store_rotations(const BoneColumns& columns, int first, int count) {
    const Asf::Bone& bone = asf_.bones[static_cast<std::size_t>(columns.joint)];
    const EulerOrder order{.axes = columns.joint == 0 ? asf_.root_axes : std::array<int, 3>{2, 1, 0}};
    std::array<const double*, 3> angles{};
    for (std::size_t i = 0; i < 3; ++i) {
      const int index = columns.rotation[static_cast<std::size_t>(order.axes[i])];
      angles[i] = column(index);
      if (index < 0 || !radians_) continue;
      double* values = block_.data(static_cast<std::size_t>(index));
      for (int f = 0; f < count; ++f) values[f] *= 180 / std::numbers::pi;
    }
    double* out = clip_.rotation_track(columns.joint).data() + static_cast<std::size_t>(first) * 4;
    quaternions_from_euler(order, angles[0], angles[1], angles[2], count, out);
    if (bone.axis.vec() != Eigen::Vector3d::Zero()) turn_axes(bone.axis, out, count);
  }

  // The root's values are where it is, with the rest position for an axis that has none; a bone's move it from its
  // rest.
  void store_translations(const BoneColumns& columns, TranslationBuilder& translation, int count) {
    const Eigen::Vector3d& rest = asf_.skeleton.joints[static_cast<std::size_t>(columns.joint)].offset;
    Eigen::Vector3d base = rest;
    for (int axis = 0; axis < 3 && columns.joint == 0; ++axis) {
      if (columns.position[static_cast<std::size_t>(axis)] >= 0) base[axis] = 0;
    }
    const Eigen::Matrix3d turn =
        asf_.bones[static_cast<std::size_t>(columns.joint)].axis.toRotationMatrix() * asf_.cm_per_unit;
    const double* const x = column(columns.position[0]);
    const double* const y = column(columns.position[1]);
    const double* const z = column(columns.position[2]);
    for (int f = 0; f < count; ++f) translation.append(base + turn * Eigen::Vector3d(x[f], y[f], z[f]));
  }

  const TextSource& source_;
  const Asf& asf_;
  const ClipReadOptions& options_;
  const char* at_;
  bool radians_;
  double rate_hz_ = usual_rate_hz;
  std::vector<BoneColumns> layout_;  // by joint
  ColumnBlock block_;
  std::vector<int> follows_;
  std::vector<int> seen_in_;  // by joint: the last frame that had it
  std::vector<double> zeros_;
  std::unordered_map<std::string_view, int> joint_of_;
  std::size_t wanted_ = 0;
  std::int64_t number_ = 0;
  std::int64_t step_ = 1;     // from one frame number to the next
  bool gaps_ = false;         // frames are left out
  std::vector<double> last_;  // the last row of the block before
  Clip clip_;
  std::vector<TranslationBuilder> translations_;
};

}  // namespace

Clip parse_amc(std::string_view text, const Asf& asf, const std::string& source_name, const ClipReadOptions& options) {
  const TextSource source(text, source_name);
  return AmcParser(source, asf, std::filesystem::path(source_name).stem().string(), options).parse();
}

Clip read_amc(const std::filesystem::path& amc, const std::filesystem::path& asf, const ClipReadOptions& options) {
  const Asf skeleton = read_asf(asf);
  const FileContent file(amc);
  return parse_amc(file.text(), skeleton, amc.string(), options);
}

namespace {

// Rotations as rx ry rz, which compose as Rz Ry Rx.
constexpr EulerOrder zyx{.axes = {2, 1, 0}};

struct Bone {
  std::string name;
  int joint = -1;   // -1: a helper without motion
  int parent = -1;  // bone; -1 for those on the root
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  bool rotates = false;
  bool moves = false;
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  // the end of the parent: what the translation dofs count from
};

// Names are single words that neither start like a comment, a keyword or a frame number nor come twice.
class Names {
 public:
  std::string make(const std::string& wish) {
    std::string name;
    for (const char c : wish) {
      const bool plain = static_cast<unsigned char>(c) > 0x20 && c != 0x7f;
      name += plain && std::string_view("#,():").find(c) == std::string_view::npos ? c : '_';
    }
    if (name.empty() || is_digit(name.front()) || same_word(name, "begin") || same_word(name, "end")) name = "_" + name;
    std::string unique = name;
    for (int i = 2; !used_.insert(unique).second; ++i) unique = name + "_" + std::to_string(i);
    return unique;
  }

 private:
  std::unordered_set<std::string> used_ = {"root"};
};

class Bones {
 public:
  explicit Bones(const Clip& clip)
      : clip_(clip), children_(clip.skeleton.joints.size()), bone_of_(children_.size(), -1) {
    const auto& joints = clip.skeleton.joints;
    for (std::size_t j = 1; j < joints.size(); ++j) {
      children_[static_cast<std::size_t>(joints[j].parent)].push_back(static_cast<int>(j));
    }
    std::vector<std::string> names{"root"};
    for (std::size_t j = 1; j < joints.size(); ++j) names.push_back(names_.make(joints[j].name));
    for (int j = 1; j < clip.skeleton.joint_count(); ++j) add(j, names[static_cast<std::size_t>(j)]);
  }

  std::vector<Bone> take() && { return std::move(bones_); }

 private:
  bool moves(int joint) const { return clip_.translation_track(joint) != nullptr; }
  const Joint& joint(int index) const { return clip_.skeleton.joints[static_cast<std::size_t>(index)]; }

  // A joint's bone ends where its children start: the first one that is not at the joint itself decides.
  Eigen::Vector3d vector_of(int j) const {
    for (const int child : children_[static_cast<std::size_t>(j)]) {
      if (!moves(child) && !joint(child).offset.isZero(0)) return joint(child).offset;
    }
    return children_[static_cast<std::size_t>(j)].empty() ? joint(j).end_site.value_or(Eigen::Vector3d::Zero())
                                                          : Eigen::Vector3d::Zero();
  }

  bool rotates(int j) const {
    if (joint(j).has_rotation()) return true;
    const auto track = clip_.rotation_track(j);
    for (std::size_t i = 0; i < track.size(); i += 4) {
      if (track[i + 1] != 0 || track[i + 2] != 0 || track[i + 3] != 0) return true;
    }
    return false;
  }

  void add(int j, std::string name) {
    const int parent_joint = joint(j).parent;
    const int parent = bone_of_[static_cast<std::size_t>(parent_joint)];  // -1 for the root
    Bone bone{.name = std::move(name), .joint = j, .parent = parent, .vector = vector_of(j), .rotates = rotates(j)};
    bone.moves = moves(j);
    bone.start = parent < 0 ? Eigen::Vector3d::Zero() : bones_[static_cast<std::size_t>(parent)].vector;
    if (!bone.moves && bone.start != joint(j).offset) {
      const std::string above = parent < 0 ? "root" : bones_[static_cast<std::size_t>(parent)].name;
      bones_.push_back(
          {.name = names_.make(above + "_to_" + bone.name), .parent = parent, .vector = joint(j).offset - bone.start});
      bone.parent = static_cast<int>(bones_.size()) - 1;
    }
    bone_of_[static_cast<std::size_t>(j)] = static_cast<int>(bones_.size());
    bones_.push_back(std::move(bone));
  }

  const Clip& clip_;
  std::vector<std::vector<int>> children_;
  std::vector<int> bone_of_;
  Names names_;
  std::vector<Bone> bones_;
};

void append_vector(std::string& out, const char* word, const Eigen::Vector3d& v) {
  out += word;
  for (const double x : v) {
    out += ' ';
    append_exact(out, x);
  }
  out += '\n';
}

void append_bone(std::string& out, const Bone& bone, std::size_t id) {
  const double length = bone.vector.norm();
  out += "  begin\n    id " + std::to_string(id) + "\n    name " + bone.name + "\n";
  append_vector(out, "    direction", length > 0 ? Eigen::Vector3d(bone.vector / length) : Eigen::Vector3d::UnitY());
  out += "    length ";
  append_exact(out, length);
  out += "\n    axis 0 0 0 XYZ\n";
  if (bone.moves || bone.rotates) {
    out += "    dof";
    if (bone.moves) out += " tx ty tz";
    if (bone.rotates) out += " rx ry rz";
    out += '\n';
  }
  out += "  end\n";
}

// One line a parent. Parents come before their children in the list of bones, and so here.
void append_hierarchy(std::string& out, const std::vector<Bone>& bones) {
  std::vector<std::string> below(bones.size() + 1);  // 0 is the root
  for (const Bone& bone : bones)
    below[bone.parent < 0 ? 0 : static_cast<std::size_t>(bone.parent) + 1] += " " + bone.name;
  out += ":hierarchy\n  begin\n";
  for (std::size_t b = 0; b < below.size(); ++b) {
    if (!below[b].empty()) out += "    " + (b == 0 ? "root" : bones[b - 1].name) + below[b] + "\n";
  }
  out += "  end\n";
}

std::string format_asf(const Clip& clip, const std::vector<Bone>& bones) {
  std::string out =
      "# Acclaim skeleton file written by kinespace\n:version 1.10\n:name kinespace\n:units\n  mass 1.0\n  length "
      "2.54\n"
      "  angle deg\n:root\n  order TX TY TZ RX RY RZ\n  axis XYZ\n";
  append_vector(out, "  position", clip.skeleton.joints[0].offset);
  out += "  orientation 0 0 0\n:bonedata\n";
  for (std::size_t b = 0; b < bones.size(); ++b) append_bone(out, bones[b], b + 1);
  append_hierarchy(out, bones);
  return out;
}

class AmcWriter {
 public:
  AmcWriter(const Clip& clip, const std::vector<Bone>& bones)
      : clip_(clip), bones_(bones), near_(bones.size() + 1), block_(3 * (bones.size() + 1)) {}

  std::string write() && {
    out_ = ":FULLY-SPECIFIED\n:DEGREES\n:SAMPLES-PER-SECOND ";
    append_exact(out_, clip_.rate_hz);
    out_ += '\n';
    for (int first = 0; first < clip_.frames; first += block_.rows()) {
      const int some = std::min(block_.rows(), clip_.frames - first);
      fill(0, 0, first, some);
      for (std::size_t b = 0; b < bones_.size(); ++b) {
        if (bones_[b].rotates) fill(b + 1, bones_[b].joint, first, some);
      }
      for (int row = 0; row < some; ++row) append_frame(first + row, row);
    }
    return std::move(out_);
  }

 private:
  void fill(std::size_t slot, int joint, int first, int some) {
    euler_columns(clip_, joint, zyx, first, some, block_.data(3 * slot), block_.rows(), near_[slot], first > 0);
  }

  void number(double value) {
    out_ += ' ';
    append_fixed(out_, value);
  }

  void angles(std::size_t slot, int row) {
    for (std::size_t axis = 0; axis < 3; ++axis) number(block_.data(3 * slot + 2 - axis)[row]);
  }

  void position(const Eigen::Vector3d& value) {
    for (const double x : value) number(x);
  }

  void append_frame(int frame, int row) {
    out_ += std::to_string(frame + 1);
    out_ += "\nroot";
    position(clip_.translation(0, frame));
    angles(0, row);
    out_ += '\n';
    for (std::size_t b = 0; b < bones_.size(); ++b) {
      const Bone& bone = bones_[b];
      if (!bone.moves && !bone.rotates) continue;
      out_ += bone.name;
      if (bone.moves) position(clip_.translation(bone.joint, frame) - bone.start);
      if (bone.rotates) angles(b + 1, row);
      out_ += '\n';
    }
  }

  const Clip& clip_;
  const std::vector<Bone>& bones_;
  std::vector<EulerAngles> near_;  // 0 is the root
  ColumnBlock block_;
  std::string out_;
};

}  // namespace

AcclaimText format_amc(const Clip& clip) {
  const std::vector<Bone> bones = Bones(clip).take();
  return {.asf = format_asf(clip, bones), .amc = AmcWriter(clip, bones).write()};
}

void write_amc(const std::filesystem::path& amc, const Clip& clip) {
  const AcclaimText text = format_amc(clip);
  const std::array files = {FileToWrite{std::filesystem::path(amc).replace_extension(".asf"), text.asf},
                            FileToWrite{amc, text.amc}};
  write_files_atomically(files);
}

}  // namespace kinespace
