#include <algorithm>
#include <string>
#include <vector>

#include "kinespace/base/file.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/detail/motion_builder.h"
#include "kinespace/motion/euler.h"
#include "kinespace/motion/text.h"

namespace kinespace {
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
