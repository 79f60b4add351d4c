#include "kinespace/motion/asf.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "kinespace/base/file.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

// A line's words, after the comment is cut off. Every word points into the text, so that an error finds its line.
using Words = std::vector<std::string_view>;

class Lines {
 public:
  explicit Lines(const TextSource& source) : source_(source), at_(source.begin()) {}

  // False at the end of the file. Lines without words are passed over.
  bool next(Words& words) {
    for (words.clear(); words.empty();) {
      if (at_ == source_.end()) return false;
      split(words);
    }
    return true;
  }

 private:
  void split(Words& words) {
    const char* const end = source_.end();
    const auto separates = [](char c) { return is_blank(c) || c == ',' || c == '(' || c == ')'; };
    bool comment = false;
    while (at_ != end && !is_line_end(*at_)) {
      comment = comment || *at_ == '#';
      if (comment || separates(*at_)) {
        ++at_;
        continue;
      }
      const char* const first = at_;
      while (at_ != end && !is_line_end(*at_) && !separates(*at_) && *at_ != '#') ++at_;
      words.emplace_back(first, static_cast<std::size_t>(at_ - first));
    }
    if (at_ != end) ++at_;
  }

  const TextSource& source_;
  const char* at_;
};

struct RawBone {
  std::string_view name;
  std::optional<Eigen::Vector3d> direction;
  std::optional<double> length;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  std::array<int, 3> axis_order = {0, 1, 2};  // about X first
  std::vector<Channel> dofs;
  int parent = -1;  // 0 is the root
};

class AsfParser {
 public:
  explicit AsfParser(const TextSource& source) : source_(source), lines_(source) {
    bones_.push_back({.name = "root", .direction = Eigen::Vector3d::Zero(), .length = 0});
    index_.emplace("root", 0);
  }

  Asf parse() && {
    Words words;
    std::string_view section;
    while (lines_.next(words)) {
      if (words[0].front() == ':') {
        section = words[0];
        has_root_ = has_root_ || same_word(section, ":root");
      } else if (same_word(section, ":units")) {
        units(words);
      } else if (same_word(section, ":root")) {
        root(words);
      } else if (same_word(section, ":bonedata")) {
        bone_data(words);
      } else if (same_word(section, ":hierarchy")) {
        hierarchy(words);
      }
    }
    if (!has_root_) fail_at_end("no :root section", "the sections of an ASF file", "check that this is an ASF file");
    if (open_) fail_at_end("a bone without end", "\"end\" after the last bone", "the file is cut short");
    return assemble();
  }

 private:
  [[noreturn]] void fail_at_end(std::string found, std::string expected, std::string remedy = {}) const {
    source_.fail(source_.end(), std::move(found), std::move(expected), std::move(remedy));
  }

  double number(const Words& words, std::size_t i, const std::string& expected) const {
    if (i >= words.size()) source_.fail(words.back().data(), "too few values", expected);
    double value = 0;
    const char* const last = words[i].data() + words[i].size();
    if (scan_number(words[i].data(), last, value) != last || !(std::abs(value) <= largest_number)) {
      source_.fail_at_word(words[i].data(), expected);
    }
    return value;
  }

  Eigen::Vector3d vector(const Words& words, const std::string& expected) const {
    return {number(words, 1, expected), number(words, 2, expected), number(words, 3, expected)};
  }

  void units(const Words& words) {
    if (same_word(words[0], "length")) {
      const double length = number(words, 1, "a positive length unit");
      if (!(length >= 1e-6)) source_.fail_at_word(words[1].data(), "a length unit of at least 1e-6");
      asf_.cm_per_unit = 2.54 / length;
    } else if (same_word(words[0], "angle")) {
      if (words.size() < 2) source_.fail(words[0].data(), "no unit", "angle deg or angle rad");
      if (!same_word(words[1], "deg") && !same_word(words[1], "rad"))
        source_.fail_at_word(words[1].data(), "deg or rad");
      asf_.radians = same_word(words[1], "rad");
    }
  }

  // "XYZ" in any order.
  std::array<int, 3> axis_order(std::string_view letters) const {
    std::array<int, 3> order{};
    std::array<bool, 3> seen{};
    for (std::size_t i = 0; i < letters.size() && i < 3; ++i) {
      const int axis = (letters[i] | 0x20) - 'x';
      if (axis < 0 || axis > 2) break;
      order[i] = axis;
      seen[static_cast<std::size_t>(axis)] = true;
    }
    if (letters.size() != 3 || !(seen[0] && seen[1] && seen[2])) {
      source_.fail_at_word(letters.data(), "the letters X, Y and Z in some order");
    }
    return order;
  }

  std::vector<Channel> dofs(const Words& words) const {
    static constexpr std::array<std::string_view, 6> names = {"tx", "ty", "tz", "rx", "ry", "rz"};
    std::vector<Channel> out;
    for (std::size_t i = 1; i < words.size(); ++i) {
      const auto found = std::ranges::find_if(names, [&](std::string_view name) { return same_word(name, words[i]); });
      if (same_word(words[i], "l")) {
        source_.fail(words[i].data(), "the dof l, a bone that stretches", "rigid bones, with dofs tx ty tz rx ry rz",
                     "export the motion without bone stretching");
      }
      if (found == names.end()) source_.fail_at_word(words[i].data(), "dofs among tx ty tz rx ry rz");
      const auto channel = static_cast<Channel>(found - names.begin());
      if (std::ranges::find(out, channel) != out.end()) source_.fail_at_word(words[i].data(), "each dof once");
      out.push_back(channel);
    }
    return out;
  }

  void root(const Words& words) {
    if (same_word(words[0], "order")) {
      bones_[0].dofs = dofs(words);
    } else if (same_word(words[0], "axis")) {
      if (words.size() < 2) source_.fail(words[0].data(), "no axis order", "the letters X, Y and Z in some order");
      bones_[0].axis_order = axis_order(words[1]);
    } else if (same_word(words[0], "position")) {
      root_position_ = vector(words, "a position of three numbers");
    } else if (same_word(words[0], "orientation")) {
      static_cast<void>(vector(words, "an orientation of three numbers"));
    }
  }

  void bone_data(const Words& words) {
    if (same_word(words[0], "begin")) {
      if (open_) source_.fail(words[0].data(), "begin inside a bone", "end");
      open_ = true;
      bones_.emplace_back();
      return;
    }
    if (!open_) source_.fail_at_word(words[0].data(), "begin");
    RawBone& bone = bones_.back();
    if (same_word(words[0], "end")) {
      close(bone, words[0].data());
    } else if (same_word(words[0], "name")) {
      if (words.size() != 2) source_.fail(words[0].data(), "a name of several words or none", "one word");
      bone.name = words[1];
    } else if (same_word(words[0], "direction")) {
      bone.direction = vector(words, "a direction of three numbers");
    } else if (same_word(words[0], "length")) {
      bone.length = number(words, 1, "a length");
    } else if (same_word(words[0], "axis")) {
      bone.axis = vector(words, "an axis of three angles");
      if (words.size() > 4) bone.axis_order = axis_order(words[4]);
    } else if (same_word(words[0], "dof")) {
      bone.dofs = dofs(words);
    }
  }

  void close(const RawBone& bone, const char* at) {
    open_ = false;
    if (bone.name.empty()) source_.fail(at, "a bone without a name", "a name for every bone");
    const std::string name = "bone \"" + std::string(bone.name) + "\"";
    if (!bone.direction || !bone.length) source_.fail(at, name + " without direction or length", "both for every bone");
    if (!index_.emplace(bone.name, static_cast<int>(bones_.size()) - 1).second) {
      source_.fail(bone.name.data(), name + " a second time", "different names");
    }
  }

  void hierarchy(const Words& words) {
    if (words.size() == 1 && (same_word(words[0], "begin") || same_word(words[0], "end"))) return;
    const int parent = find(words[0]);
    for (std::size_t i = 1; i < words.size(); ++i) {
      const int child = find(words[i]);
      if (child == 0) source_.fail(words[i].data(), "the root below a bone", "the root above all bones");
      if (bones_[static_cast<std::size_t>(child)].parent >= 0) {
        source_.fail(words[i].data(), "bone \"" + std::string(words[i]) + "\" a second time in the hierarchy",
                     "one parent for every bone");
      }
      bones_[static_cast<std::size_t>(child)].parent = parent;
    }
  }

  int find(std::string_view name) const {
    const auto found = index_.find(name);
    if (found != index_.end()) return found->second;
    source_.fail(name.data(), "unknown bone \"" + std::string(name) + "\" in the hierarchy", "bones of :bonedata");
  }

  // Every bone after its parent, else in the order of the file. Bones that do not hang on the root are an error.
  std::vector<int> parents_first() const {
    enum class State : char { unseen, pending, placed };
    std::vector<State> state(bones_.size(), State::unseen);
    std::vector<int> order = {0};
    state[0] = State::placed;
    std::vector<int> chain;
    for (int b = 1; b < static_cast<int>(bones_.size()); ++b) {
      for (int up = b; state[static_cast<std::size_t>(up)] != State::placed;) {
        const RawBone& bone = bones_[static_cast<std::size_t>(up)];
        const std::string name = "bone \"" + std::string(bone.name) + "\"";
        if (state[static_cast<std::size_t>(up)] == State::pending) {
          source_.fail(bone.name.data(), name + " above itself: a cycle in the hierarchy", "a tree below the root");
        }
        if (bone.parent < 0) source_.fail(bone.name.data(), name + " not in the hierarchy", "a parent for every bone");
        state[static_cast<std::size_t>(up)] = State::pending;
        chain.push_back(up);
        up = bone.parent;
      }
      for (; !chain.empty(); chain.pop_back()) {
        state[static_cast<std::size_t>(chain.back())] = State::placed;
        order.push_back(chain.back());
      }
    }
    return order;
  }

  Eigen::Vector3d bone_vector(const RawBone& bone) const { return *bone.direction * (*bone.length * asf_.cm_per_unit); }

  static std::vector<Channel> channels_of(const RawBone& bone) {
    using enum Channel;
    const bool moves = std::ranges::any_of(bone.dofs, is_position);
    const bool turns = !std::ranges::all_of(bone.dofs, is_position);
    if (moves && turns) return {x_position, y_position, z_position, z_rotation, y_rotation, x_rotation};
    if (moves) return {x_position, y_position, z_position};
    if (turns) return {z_rotation, y_rotation, x_rotation};
    return {};
  }

  Eigen::Quaterniond axis_rotation(const RawBone& bone) const {
    const double unit = asf_.radians ? 1 : std::numbers::pi / 180;
    Eigen::Quaterniond out = Eigen::Quaterniond::Identity();
    for (const int axis : bone.axis_order) {
      out = Eigen::AngleAxisd(bone.axis[axis] * unit, Eigen::Vector3d::Unit(axis)) * out;
    }
    return out.normalized();
  }

  Asf assemble() {
    if (bones_[0].dofs.empty()) {
      bones_[0].dofs = {Channel::x_position, Channel::y_position, Channel::z_position,
                        Channel::x_rotation, Channel::y_rotation, Channel::z_rotation};
    }
    const auto& root_order = bones_[0].axis_order;
    asf_.root_axes = {root_order[2], root_order[1], root_order[0]};
    const std::vector<int> order = parents_first();
    std::vector<int> joint_of(bones_.size());
    for (std::size_t j = 0; j < order.size(); ++j) joint_of[static_cast<std::size_t>(order[j])] = static_cast<int>(j);
    auto& joints = asf_.skeleton.joints;
    for (const int b : order) {
      const RawBone& bone = bones_[static_cast<std::size_t>(b)];
      Joint joint{.name = std::string(bone.name), .channels = channels_of(bone), .end_site = bone_vector(bone)};
      joint.offset = root_position_ * asf_.cm_per_unit;
      if (b != 0) {
        joint.parent = joint_of[static_cast<std::size_t>(bone.parent)];
        joint.offset = bone_vector(bones_[static_cast<std::size_t>(bone.parent)]);
        joints[static_cast<std::size_t>(joint.parent)].end_site.reset();  // its children stand there
      }
      joints.push_back(std::move(joint));
      asf_.bones.push_back({.dofs = bone.dofs, .axis = axis_rotation(bone)});
    }
    asf_.bones[0].axis.setIdentity();
    joints[0].channels = {Channel::x_position, Channel::y_position, Channel::z_position,
                          Channel::z_rotation, Channel::y_rotation, Channel::x_rotation};
    return std::move(asf_);
  }

  const TextSource& source_;
  Lines lines_;
  Asf asf_;
  std::vector<RawBone> bones_;  // 0 is the root
  std::unordered_map<std::string_view, int> index_;
  Eigen::Vector3d root_position_ = Eigen::Vector3d::Zero();
  bool has_root_ = false;
  bool open_ = false;
};

}  // namespace

Asf parse_asf(std::string_view text, const std::string& source_name) {
  return AsfParser(TextSource(text, source_name)).parse();
}

Asf read_asf(const std::filesystem::path& path) {
  const FileContent file(path);
  return parse_asf(file.text(), path.string());
}

}  // namespace kinespace
