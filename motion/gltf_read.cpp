#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/gltf/animation.h"
#include "kinespace/motion/detail/gltf_skeleton.h"
#include "kinespace/motion/detail/motion_builder.h"
#include "kinespace/motion/gltf.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

constexpr double centimetres = 100;
constexpr double rate_where_none_is_found = 30;
constexpr double slowest_rate = 10;   // found from few keys: what lies between them is meant to be seen, too
constexpr double off_grid = 0.02;     // of a frame: how far a key may be from one
constexpr double same_scale = 3e-6;   // a stretch that differs by less between axes is one of all axes
constexpr double still_scale = 1e-5;  // a scale that varies by less rests
constexpr double float_blur = static_cast<double>(std::numeric_limits<float>::epsilon());

using gltf::AnimatedValue;

// When a clip's frames are: at first + f / rate.
struct FrameGrid {
  double first = 0;  // s
  double rate_hz = rate_where_none_is_found;
  int frames = 1;
  bool guessed = false;  // no rate fits the keys

  [[nodiscard]] double at(int frame) const { return first + frame / rate_hz; }
  // How far apart times may be that stand for the same, s.
  [[nodiscard]] double blur() const { return 4 * float_blur * std::max(std::abs(first), std::abs(at(frames - 1))); }
};

// Whether all keys lie on frames at this rate.
bool fits(const std::vector<const AnimatedValue*>& values, double first, double rate) {
  for (const AnimatedValue* value : values) {
    for (const float key : value->times) {
      const double time = static_cast<double>(key);
      const double frame = (time - first) * rate;
      if (std::abs(frame - std::round(frame)) > off_grid + 2 * float_blur * std::abs(time) * rate) return false;
    }
  }
  return true;
}

// The rate of the keys: that of the channel with most of them if it is even and all others lie on it, else the first
// usual one that they all lie on. 0 when there is none.
double rate_of(const std::vector<const AnimatedValue*>& values, double first) {
  const AnimatedValue& most =
      **std::ranges::max_element(values, {}, [](const AnimatedValue* value) { return value->times.size(); });
  const double even = gltf::even_rate(most.times);
  const bool baked = most.times.size() > 2 && std::ranges::all_of(values, [&](const AnimatedValue* value) {
                       return value->interpolation != AnimatedValue::Interpolation::cubic && value->times == most.times;
                     });
  if (even > 0 && (baked || even >= slowest_rate) && fits(values, first, even)) return even;
  constexpr std::array usual = {30.0, 24.0, 25.0, 60.0, 50.0, 48.0, 120.0, 100.0, 90.0, 72.0, 240.0};
  const auto* const found = std::ranges::find_if(usual, [&](double rate) { return fits(values, first, rate); });
  return found == usual.end() ? 0 : *found;
}

FrameGrid grid_of(const std::vector<const AnimatedValue*>& values, std::optional<double> wanted_hz,
                  const gltf::Accessors& accessors) {
  FrameGrid out;
  if (wanted_hz) out.rate_hz = *wanted_hz;
  if (values.empty()) return out;
  double first = static_cast<double>(values.front()->times.front()), last = first;
  for (const AnimatedValue* value : values) {
    first = std::min(first, static_cast<double>(value->times.front()));
    last = std::max(last, static_cast<double>(value->times.back()));
  }
  out.first = first;
  if (!(last > first)) return out;
  const double rate = wanted_hz ? *wanted_hz : rate_of(values, first);
  out.guessed = rate == 0;
  if (rate > 0) out.rate_hz = rate;
  const double frames = std::floor((last - first) * out.rate_hz + 0.5) + 1;
  if (!(frames <= static_cast<double>(std::numeric_limits<int>::max()))) {
    accessors.fail(fmt::format("an animation of {:.6g} s", last - first), "at most 2147483647 frames");
  }
  out.frames = static_cast<int>(frames);
  return out;
}

// Whether the keys are the frames, one for each.
bool keys_are_frames(const AnimatedValue& value, const FrameGrid& grid) {
  if (value.times.size() != static_cast<std::size_t>(grid.frames)) return false;
  const double blur = grid.blur();
  for (int f = 0; f < grid.frames; ++f) {
    if (std::abs(static_cast<double>(value.times[static_cast<std::size_t>(f)]) - grid.at(f)) > blur) return false;
  }
  return true;
}

// What a channel says at every frame, or the one thing that it says all the time.
class Column {
 public:
  Column() = default;
  Column(const AnimatedValue& value, const FrameGrid& grid, gltf::Budget& budget) : width_(value.width) {
    const auto frames = static_cast<std::size_t>(grid.frames);
    if (value.times.size() == 1) {
      const auto only = value.key(0);
      values_.assign(only.begin(), only.end());
      return;
    }
    fixed_ = false;
    budget.take(fmt::format("{} frames", frames), frames, width_ * sizeof(double));
    values_.reserve(frames * width_);
    if (keys_are_frames(value, grid)) {
      for (std::size_t f = 0; f < frames; ++f) {
        const auto key = value.key(f);
        values_.insert(values_.end(), key.begin(), key.end());
      }
    } else {
      sample(value, grid);
    }
  }
  explicit Column(std::span<const double> value) : width_(value.size()), values_(value.begin(), value.end()) {}

  [[nodiscard]] bool fixed() const { return fixed_; }
  [[nodiscard]] const double* at(int frame) const {
    return values_.data() + (fixed_ ? 0 : static_cast<std::size_t>(frame) * width_);
  }

 private:
  void sample(const AnimatedValue& value, const FrameGrid& grid) {
    const double blur = grid.blur();
    std::size_t near = 0;  // the first key that is not before the frame
    for (int f = 0; f < grid.frames; ++f) {
      const double time = grid.at(f);
      while (near < value.times.size() && static_cast<double>(value.times[near]) < time - blur) ++near;
      if (near < value.times.size() && static_cast<double>(value.times[near]) <= time + blur) {
        const auto key = value.key(near);
        values_.insert(values_.end(), key.begin(), key.end());
      } else {
        const std::vector<double> between = value.at(time);
        values_.insert(values_.end(), between.begin(), between.end());
      }
    }
  }

  std::size_t width_ = 0;
  bool fixed_ = true;
  std::vector<double> values_;
};

// A node in one animation.
struct NodeMotion {
  Column translation, rotation;  // rotation: x, y, z, w
  std::optional<Column> scale;   // where it is animated
  Eigen::Matrix3d stretch;       // else

  [[nodiscard]] Eigen::Matrix3d stretch_at(int frame) const {
    return scale ? Eigen::Matrix3d(Eigen::Map<const Eigen::Vector3d>(scale->at(frame)).asDiagonal()) : stretch;
  }
  [[nodiscard]] Eigen::Vector3d translation_at(int frame) const {
    return Eigen::Map<const Eigen::Vector3d>(translation.at(frame));
  }
  [[nodiscard]] Eigen::Quaterniond rotation_at(int frame) const {
    return Eigen::Map<const Eigen::Quaterniond>(rotation.at(frame));
  }
};

bool is_of_all_axes(const Eigen::Matrix3d& stretch) {
  const double mean = stretch.trace() / 3;
  return (stretch - Eigen::Matrix3d::Identity() * mean).cwiseAbs().maxCoeff() <= same_scale * std::abs(mean);
}

// The linear part of a joint's place in the scene is its rotation, the product of those of all nodes above it, times
// this: what scales have piled up. Of all axes alike, it is the same whatever turns; else it changes with the pose.
class Stretch {
 public:
  [[nodiscard]] bool fixed() const { return values_.empty(); }
  [[nodiscard]] const Eigen::Matrix3d& at(int frame) const {
    return fixed() ? fixed_ : values_[static_cast<std::size_t>(frame)];
  }
  void set(const Eigen::Matrix3d& value) { fixed_ = value; }
  void set(int frame, int frames, const Eigen::Matrix3d& value) {
    values_.resize(static_cast<std::size_t>(frames));
    values_[static_cast<std::size_t>(frame)] = value;
  }

 private:
  Eigen::Matrix3d fixed_ = Eigen::Matrix3d::Identity();
  std::vector<Eigen::Matrix3d> values_;
};

// One animation (or none: the rest pose) of a file.
class GltfClip {
 public:
  GltfClip(const gltf::Document& document, const gltf::Accessors& accessors, const GltfSkeleton& skeleton,
           const std::vector<char>& moves)
      : document_(document), accessors_(accessors), skeleton_(skeleton), moves_(moves) {}

  Clip read(std::string name, const gltf::Animation* animation, const ClipReadOptions& options) && {
    const auto& note = options.note;
    if (animation != nullptr) values_ = gltf::animated_values(document_, *animation, accessors_);
    find_channels();
    std::vector<const AnimatedValue*> seen;
    for (const AnimatedValue& value : values_) {
      const bool moves = value.path != AnimatedValue::Path::weights;
      if (moves && linked_[static_cast<std::size_t>(value.node)] != 0) seen.push_back(&value);
    }
    if (seen.empty()) {
      for (const AnimatedValue& value : values_) seen.push_back(&value);
    }
    grid_ = grid_of(seen, options.rate_hz, accessors_);
    if (grid_.guessed && note) {
      note(fmt::format("{}: the key times have no rate in common, the clip is sampled at {} Hz", name, grid_.rate_hz));
    }
    take_work();
    clip_ = make_clip(std::move(name), joints(), grid_.rate_hz, grid_.frames);
    stretches_.resize(skeleton_.joints.size());
    for (std::size_t j = 0; j < skeleton_.joints.size(); ++j) {
      add_joint(j);
    }
    finish_translations(std::move(translations_), clip_);
    for (const Clip::TranslationTrack& track : clip_.translations) {
      add_position_channels(clip_.skeleton.joints[static_cast<std::size_t>(track.joint)]);
    }
    if (stretched_ > 0 && note) {
      note(fmt::format("{}: {} node{} change{} in size; bones grow and shrink as translations of their joints",
                       clip_.name, stretched_, stretched_ == 1 ? "" : "s", stretched_ == 1 ? "s" : ""));
    }
    return std::move(clip_);
  }

 private:
  static void add_position_channels(Joint& joint) {
    if (joint.has_position()) return;
    joint.channels.insert(joint.channels.begin(), {Channel::x_position, Channel::y_position, Channel::z_position});
  }

  Skeleton joints() const {
    Skeleton out;
    for (std::size_t j = 0; j < skeleton_.joints.size(); ++j) {
      const GltfJoint& from = skeleton_.joints[j];
      Joint joint{.parent = from.parent, .channels = {Channel::z_rotation, Channel::x_rotation, Channel::y_rotation}};
      if (from.node < 0) {
        joint.name = skeleton_.root_name;
      } else {
        const std::string& name = document_.nodes[static_cast<std::size_t>(from.node)].name;
        joint.name = name.empty() ? fmt::format("node_{}", from.node) : name;
      }
      const Eigen::Vector3d above = from.parent < 0
                                        ? Eigen::Vector3d::Zero()
                                        : skeleton_.joints[static_cast<std::size_t>(from.parent)].bind_position;
      joint.offset = (from.bind_position - above) * centimetres;
      if (j == 0 || moves_[j] != 0) add_position_channels(joint);
      out.joints.push_back(std::move(joint));
    }
    return out;
  }

  void find_channels() {
    channels_.assign(document_.nodes.size(), {nullptr, nullptr, nullptr});
    linked_.assign(document_.nodes.size(), 0);
    for (const GltfJoint& joint : skeleton_.joints) {
      for (const int node : joint.links) linked_[static_cast<std::size_t>(node)] = 1;
    }
    for (const AnimatedValue& value : values_) {
      if (value.path == AnimatedValue::Path::weights) continue;
      channels_[static_cast<std::size_t>(value.node)][static_cast<std::size_t>(value.path)] = &value;
    }
  }

  // A clip's rotations take memory for every joint, a file only for those that turn.
  void take_work() const {
    const auto frames = static_cast<std::uint64_t>(grid_.frames);
    std::uint64_t links = 0;
    for (const GltfJoint& joint : skeleton_.joints) links += joint.links.size();
    accessors_.budget().take(fmt::format("{} frames of {} joints", frames, skeleton_.joints.size()), frames,
                             skeleton_.joints.size() * 4 * sizeof(double) + links);
  }

  NodeMotion motion_of(int node) {
    const auto& channels = channels_[static_cast<std::size_t>(node)];
    const GltfRest& rest = skeleton_.rest[static_cast<std::size_t>(node)];
    const auto column = [&](AnimatedValue::Path path, const auto& value) {
      const AnimatedValue* const channel = channels[static_cast<std::size_t>(path)];
      return channel != nullptr ? Column(*channel, grid_, accessors_.budget())
                                : Column(std::span<const double>(value.data(), static_cast<std::size_t>(value.size())));
    };
    NodeMotion out{.translation = column(AnimatedValue::Path::translation, rest.translation),
                   .rotation = column(AnimatedValue::Path::rotation, rest.rotation.coeffs()),
                   .scale = {},
                   .stretch = rest.stretch};
    if (const AnimatedValue* const scale = channels[static_cast<std::size_t>(AnimatedValue::Path::scale)]) {
      if (scale->range() > still_scale) {
        out.scale = Column(*scale, grid_, accessors_.budget());
        ++stretched_;
      } else {
        const auto first = scale->key(0);
        out.stretch = Eigen::Vector3d(first[0], first[1], first[2]).asDiagonal();
      }
    }
    return out;
  }

  [[noreturn]] void fail_at(std::size_t joint, int frame, const char* what) const {
    accessors_.fail(
        fmt::format("{} at joint \"{}\" in frame {}", what, clip_.skeleton.joints[joint].name.substr(0, 80), frame + 1),
        "finite numbers, rotations of length 1");
  }

  Eigen::Quaterniond require_rotation(Eigen::Quaterniond q, std::size_t joint, int frame) const {
    const double length = q.squaredNorm();
    if (!(length > 1e-12 && length < 1e12)) fail_at(joint, frame, "a rotation that is none");
    q.coeffs() /= std::sqrt(length);
    return q;
  }
  void require_position(const Eigen::Vector3d& at, std::size_t joint, int frame) const {
    if (!(at.cwiseAbs().maxCoeff() <= largest_number)) fail_at(joint, frame, "a position beyond all lengths");
  }

  void add_joint(std::size_t j) {
    const GltfJoint& joint = skeleton_.joints[j];
    std::vector<NodeMotion> links;
    for (const int node : joint.links) links.push_back(motion_of(node));
    Eigen::Quaterniond above = Eigen::Quaterniond::Identity();
    if (joint.parent >= 0) above = skeleton_.joints[static_cast<std::size_t>(joint.parent)].bind;
    add_rotations(j, above, links);
    const Stretch none;
    const Stretch& outer = joint.parent >= 0 ? stretches_[static_cast<std::size_t>(joint.parent)] : none;
    add_stretch(j, outer, links);
    add_translations(j, above, outer, links);
    if (joint.end >= 0) add_end(j);
  }

  void add_rotations(std::size_t j, const Eigen::Quaterniond& above, const std::vector<NodeMotion>& links) {
    const Eigen::Quaterniond own = skeleton_.joints[j].bind.conjugate();
    const bool fixed = std::ranges::all_of(links, [](const NodeMotion& link) { return link.rotation.fixed(); });
    double* out = clip_.rotation_track(static_cast<int>(j)).data();
    Eigen::Quaterniond before = Eigen::Quaterniond::Identity();
    for (int f = 0; f < grid_.frames; ++f, out += 4) {
      Eigen::Quaterniond q = before;
      if (f == 0 || !fixed) {
        q = above;
        for (const NodeMotion& link : links) q = q * require_rotation(link.rotation_at(f), j, f);
        q = (q * own).normalized();
        if (q.dot(before) < 0) q.coeffs() = -q.coeffs();
        before = q;
      }
      out[0] = q.w();
      out[1] = q.x();
      out[2] = q.y();
      out[3] = q.z();
    }
  }

  static Eigen::Matrix3d stretched(Eigen::Matrix3d outer, const std::vector<NodeMotion>& links, int frame) {
    for (const NodeMotion& link : links) {
      const Eigen::Matrix3d turn = link.rotation_at(frame).normalized().toRotationMatrix();
      outer = turn.transpose() * outer * turn * link.stretch_at(frame);
    }
    return outer;
  }

  // Whether what has piled up at a joint is the same in all poses: scales of all axes alike, but for the last, under
  // which nothing turns.
  static bool stays(const Stretch& outer, const std::vector<NodeMotion>& links) {
    bool same = outer.fixed();
    bool alike = same && is_of_all_axes(outer.at(0));
    for (const NodeMotion& link : links) {
      same = same && !link.scale && (alike || link.rotation.fixed());
      alike = alike && is_of_all_axes(link.stretch);
    }
    return same;
  }

  void add_stretch(std::size_t j, const Stretch& outer, const std::vector<NodeMotion>& links) {
    if (stays(outer, links)) {
      Eigen::Matrix3d all = stretched(outer.at(0), links, 0);
      if (is_of_all_axes(all)) all = Eigen::Matrix3d::Identity() * (all.trace() / 3);
      stretches_[j].set(all);
      return;
    }
    accessors_.budget().take("scales", static_cast<std::uint64_t>(grid_.frames), sizeof(Eigen::Matrix3d));
    for (int f = 0; f < grid_.frames; ++f) stretches_[j].set(f, grid_.frames, stretched(outer.at(f), links, f));
  }

  // In the frame of the joint above.
  static Eigen::Vector3d position(Eigen::Matrix3d outer, const std::vector<NodeMotion>& links, int frame) {
    if (links.size() == 1) return outer * links.front().translation_at(frame);
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
    for (const NodeMotion& link : links) {
      at += turned * (outer * link.translation_at(frame));
      const Eigen::Matrix3d turn = link.rotation_at(frame).normalized().toRotationMatrix();
      turned = turned * turn;
      outer = turn.transpose() * outer * turn * link.stretch_at(frame);
    }
    return at;
  }

  static bool rests(const Stretch& outer, const std::vector<NodeMotion>& links) {
    bool out = outer.fixed();
    for (std::size_t i = 0; i < links.size(); ++i) {
      const NodeMotion& link = links[i];
      out = out && link.translation.fixed();
      if (i + 1 < links.size()) out = out && link.rotation.fixed() && !link.scale;
    }
    return out;
  }

  void add_translations(std::size_t j, const Eigen::Quaterniond& above, const Stretch& outer,
                        const std::vector<NodeMotion>& links) {
    const Eigen::Matrix3d turn = above.toRotationMatrix() * centimetres;
    if (rests(outer, links)) {
      const Eigen::Vector3d at = turn * position(outer.at(0), links, 0);
      require_position(at, j, 0);
      clip_.skeleton.joints[j].offset = at;
      return;
    }
    TranslationBuilder& builder = translations_.emplace_back(static_cast<int>(j), grid_.frames);
    for (int f = 0; f < grid_.frames; ++f) {
      const Eigen::Vector3d at = turn * position(outer.at(f), links, f);
      require_position(at, j, f);
      builder.append(at);
    }
  }

  void add_end(std::size_t j) {
    const GltfJoint& joint = skeleton_.joints[j];
    const Eigen::Vector3d at = joint.bind *
                               (stretches_[j].at(0) * skeleton_.rest[static_cast<std::size_t>(joint.end)].translation) *
                               centimetres;
    require_position(at, j, 0);
    clip_.skeleton.joints[j].end_site = at;
  }

  const gltf::Document& document_;
  const gltf::Accessors& accessors_;
  const GltfSkeleton& skeleton_;
  const std::vector<char>& moves_;  // by joint: in any animation of the file
  std::vector<AnimatedValue> values_;
  std::vector<std::array<const AnimatedValue*, 3>> channels_;  // by node and path
  std::vector<char> linked_;                                   // by node: part of a joint's place
  FrameGrid grid_;
  std::vector<Stretch> stretches_;  // by joint
  std::vector<TranslationBuilder> translations_;
  int stretched_ = 0;  // nodes whose scale is animated
  Clip clip_;
};

// By joint: whether an animation of the file moves it in its parent's frame. All clips of a file have the same channels.
std::vector<char> moving_joints(const gltf::Document& document, const gltf::Accessors& accessors,
                                const GltfSkeleton& skeleton) {
  std::vector<char> out(skeleton.joints.size(), 0);
  std::vector<int> joint_of(document.nodes.size(), -1);
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    for (const int node : skeleton.joints[j].links) joint_of[static_cast<std::size_t>(node)] = static_cast<int>(j);
  }
  for (gltf::Animation animation : document.animations) {
    std::erase_if(animation.channels, [&](const gltf::Animation::Channel& channel) {
      const bool known = static_cast<std::size_t>(channel.node) < joint_of.size();
      return channel.path != gltf::Animation::Path::translation ||
             (known && joint_of[static_cast<std::size_t>(channel.node)] < 0);
    });
    for (const AnimatedValue& value : gltf::animated_values(document, animation, accessors)) {
      const auto joint = static_cast<std::size_t>(joint_of[static_cast<std::size_t>(value.node)]);
      if (value.range() * skeleton.joints[joint].scale_above * centimetres > still_cm) out[joint] = 1;
    }
  }
  return out;
}

// The animations to read, by index.
std::vector<std::size_t> chosen(const gltf::Document& document, const std::string& file, const ClipReadOptions& options,
                                ClipsWanted wanted) {
  if (!options.animation.empty()) return {gltf::find_animation(document, options.animation, file)};
  std::vector<std::size_t> out(wanted == ClipsWanted::one ? 1 : document.animations.size());
  std::iota(out.begin(), out.end(), std::size_t{0});
  if (document.animations.size() > 1 && wanted == ClipsWanted::one && options.note) {
    options.note(fmt::format("{}: the first of {} animations is read; --animation takes another by name or number: {}",
                             file, document.animations.size(), gltf::listed_names(document)));
  }
  return out;
}

gltf::Budget budget_of(const std::string& file, std::size_t bytes) {
  return {file, bytes, {}, "save its animations with fewer frames, or in several files"};
}

}  // namespace

std::vector<Clip> parse_gltf(std::string_view bytes, const std::filesystem::path& file, const ClipReadOptions& options,
                             ClipsWanted wanted) {
  const std::string name = file.string(), stem = file.stem().string();
  gltf::Budget budget = budget_of(name, bytes.size());
  const gltf::Document document = gltf::read_document(bytes, file, budget, {}, gltf::Content::motion);
  const gltf::Accessors accessors(document, name, budget);
  const GltfSkeleton skeleton = gltf_skeleton(document, accessors);
  const std::vector<char> moves = moving_joints(document, accessors, skeleton);
  std::vector<Clip> out;
  if (document.animations.empty() && options.animation.empty()) {
    if (options.note) options.note(fmt::format("{}: no animation; the rest pose is read, one frame", name));
    out.push_back(GltfClip(document, accessors, skeleton, moves).read(stem, nullptr, options));
    return out;
  }
  const std::vector<std::string> names = gltf::animation_names(document);
  for (const std::size_t i : chosen(document, name, options, wanted)) {
    out.push_back(GltfClip(document, accessors, skeleton, moves)
                      .read(names.size() > 1 ? stem + "." + names[i] : stem, &document.animations[i], options));
  }
  return out;
}

std::vector<Clip> read_gltf(const std::filesystem::path& path, const ClipReadOptions& options, ClipsWanted wanted) {
  const FileContent file(path);
  return parse_gltf(file.text(), path, options, wanted);
}

std::vector<std::string> gltf_clips(const std::filesystem::path& path) {
  const FileContent file(path);
  gltf::Budget budget = budget_of(path.string(), file.bytes().size());
  return gltf::animation_names(gltf::read_document(file.text(), path, budget, {}, gltf::Content::motion));
}

}  // namespace kinespace
