#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "kinespace/base/file.h"
#include "kinespace/motion/amc.h"
#include "kinespace/motion/detail/motion_builder.h"
#include "kinespace/motion/euler.h"
#include "kinespace/motion/text.h"

namespace kinespace {
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
