#include "kinespace/codecs/stream/clip_table.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/entropy/integer_coder.h"
#include "kinespace/motion/curves.h"

namespace kinespace {
namespace {

constexpr std::int64_t most_joints = 4096;
constexpr std::int64_t longest_name = 1 << 16;
constexpr std::int64_t most_side_bytes = std::int64_t{1} << 30;

// Contexts of entropy/integer_coder.h, by what the number is.
enum TableNumber : int {
  count,
  length,
  parent,
  channel,
  skeleton_number,
  rate_number,
  frame_count,
  place,
  heading,
  block,
  side,
  fineness
};

// Text that resembles the text before it: as long as the two agree, the byte there predicts; then the byte before.
class TextContext {
 public:
  explicit TextContext(const std::string& model) : model_(model) {}
  [[nodiscard]] std::uint8_t next() const {
    const std::uint8_t ahead = at_ < model_.size() ? static_cast<std::uint8_t>(model_[at_]) : std::uint8_t{0};
    return agrees_ ? static_cast<std::uint8_t>(128 | (ahead & 127)) : static_cast<std::uint8_t>(last_ & 127);
  }
  void see(std::uint8_t byte) {
    agrees_ = agrees_ && at_ < model_.size() && static_cast<std::uint8_t>(model_[at_]) == byte;
    // After a separator the texts may agree again.
    const bool separator = byte == '_' || byte == '-' || byte == ' ';
    if (!agrees_ && separator) {
      const std::size_t found = model_.find(static_cast<char>(byte), std::min(at_, model_.size()));
      if (found != std::string::npos) {
        at_ = found;
        agrees_ = true;
      }
    }
    ++at_;
    last_ = byte;
  }

 private:
  const std::string& model_;
  std::size_t at_ = 0;
  bool agrees_ = true;
  std::uint8_t last_ = 0;
};

void put_text(IntegerWriter& out, const std::string& text, const std::string& model) {
  out.put(static_cast<std::int64_t>(text.size()) - static_cast<std::int64_t>(model.size()), length);
  TextContext context(model);
  for (const char c : text) {
    out.put_byte(static_cast<std::uint8_t>(c), context.next());
    context.see(static_cast<std::uint8_t>(c));
  }
}

std::string get_text(IntegerReader& in, const std::string& model) {
  const std::int64_t size = static_cast<std::int64_t>(model.size()) + in.get(length);
  if (size < 0 || size > longest_name) in.damaged();
  std::string out;
  TextContext context(model);
  for (std::int64_t i = 0; i < size; ++i) {
    const std::uint8_t byte = in.get_byte(context.next());
    context.see(byte);
    out.push_back(static_cast<char>(byte));
  }
  return out;
}

void put_raw(IntegerWriter& out, std::span<const std::byte> bytes) {
  std::uint8_t at = 0;
  for (const std::byte b : bytes) out.put_byte(static_cast<std::uint8_t>(b), at++ % 8);
}

template <typename T>
void put_number(IntegerWriter& out, T value) {
  put_raw(out, std::as_bytes(std::span<const T, 1>(&value, 1)));
}

template <typename T>
T get_number(IntegerReader& in) {
  std::array<std::byte, sizeof(T)> raw;
  std::uint8_t at = 0;
  for (std::byte& b : raw) b = static_cast<std::byte>(in.get_byte(at++ % 8));
  T value;
  std::memcpy(&value, raw.data(), sizeof(T));
  if (!std::isfinite(value)) in.damaged();
  return value;
}

void put_vector(IntegerWriter& out, const Eigen::Vector3d& v) {
  for (int k = 0; k < 3; ++k) put_number(out, static_cast<float>(v[k]));
}

Eigen::Vector3d get_vector(IntegerReader& in) {
  Eigen::Vector3d out;
  for (int k = 0; k < 3; ++k) out[k] = get_number<float>(in);
  return out;
}

void put_skeleton(IntegerWriter& out, const Skeleton& skeleton, const Skeleton* model) {
  out.put(skeleton.joint_count(), count);
  std::string name;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    const bool known = model != nullptr && j < model->joints.size();
    if (known) name = model->joints[j].name;
    put_text(out, joint.name, name);
    name = joint.name;
    if (j > 0) out.put(static_cast<std::int64_t>(j) - joint.parent, parent);
    out.put(static_cast<std::int64_t>(joint.channels.size()), channel);
    for (const Channel c : joint.channels) out.put_byte(static_cast<std::uint8_t>(c), 8);
    put_vector(out, joint.offset);
    out.put_byte(joint.end_site ? 1 : 0, 9);
    if (joint.end_site) put_vector(out, *joint.end_site);
  }
}

std::vector<Channel> get_channels(IntegerReader& in) {
  std::vector<Channel> out;
  const std::int64_t channels = in.get_between(0, 6, channel);
  for (std::int64_t i = 0; i < channels; ++i) {
    const std::uint8_t c = in.get_byte(8);
    if (c > 5 || std::ranges::find(out, static_cast<Channel>(c)) != out.end()) in.damaged();
    out.push_back(static_cast<Channel>(c));
  }
  return out;
}

Skeleton get_skeleton(IntegerReader& in, const Skeleton* model) {
  Skeleton out;
  const std::int64_t joints = in.get_between(1, most_joints, count);
  std::string name;
  for (std::int64_t j = 0; j < joints; ++j) {
    const auto at = static_cast<std::size_t>(j);
    Joint joint;
    if (model != nullptr && at < model->joints.size()) name = model->joints[at].name;
    joint.name = get_text(in, name);
    name = joint.name;
    if (j > 0) joint.parent = static_cast<int>(j - in.get_between(1, j, parent));
    joint.channels = get_channels(in);
    joint.offset = get_vector(in);
    const std::uint8_t has_end = in.get_byte(9);
    if (has_end > 1) in.damaged();
    if (has_end == 1) joint.end_site = get_vector(in);
    out.joints.push_back(std::move(joint));
  }
  const std::size_t rotating = out.rotating_joints().size();
  if (rotating < 1 || rotating > most_rotating_joints) in.damaged();
  return out;
}

void put_clip(IntegerWriter& out, const ClipEntry& clip, const ClipEntry& last) {
  put_text(out, clip.name, last.name);
  out.put(clip.skeleton - last.skeleton, skeleton_number);
  const bool same_rate = std::bit_cast<std::uint64_t>(clip.rate_hz) == std::bit_cast<std::uint64_t>(last.rate_hz);
  out.put(same_rate ? 0 : 1, rate_number);
  if (!same_rate) put_number(out, clip.rate_hz);
  for (std::size_t k = 0; k < 3; ++k) out.put(clip.placement.position[k] - last.placement.position[k], place);
  out.put(clip.placement.heading - last.placement.heading, heading);
  out.put(static_cast<std::int64_t>(clip.blocks.size()), frame_count);
  int before = last.blocks.empty() ? 0 : last.blocks.back();
  for (const int b : clip.blocks) {
    out.put(b - before, block);
    before = b;
  }
  int finer = 0;
  for (const int f : clip.finer) {
    out.put(f - finer, fineness);
    finer = f;
  }
  const Bytes side_tracks = clip.side_tracks.empty() ? Bytes{} : pack_side_tracks(clip.side_tracks);
  out.put(static_cast<std::int64_t>(side_tracks.size()), side);
  put_raw(out, side_tracks);
}

void get_blocks(IntegerReader& in, ClipEntry& clip, int before, std::int64_t most_frames) {
  const std::int64_t blocks = in.get_between(1, most_frames, frame_count);
  std::int64_t frames = 0;
  for (std::int64_t i = 0; i < blocks; ++i) {
    const std::int64_t b = before + in.get(block);
    if (b < 1 || b > longest_block) in.damaged();
    before = static_cast<int>(b);
    frames += b;
    if (frames > std::min<std::int64_t>(most_frames, std::numeric_limits<int>::max())) in.damaged();
    clip.blocks.push_back(before);
  }
  clip.frames = static_cast<int>(frames);
  std::int64_t finer = 0;
  for (std::int64_t i = 0; i < blocks; ++i) {
    finer += in.get(fineness);
    if (finer < 0 || finer > finest_block) in.damaged();
    clip.finer.push_back(static_cast<int>(finer));
  }
}

ClipEntry get_clip(IntegerReader& in, const ClipEntry& last, const std::vector<Skeleton>& skeletons,
                   std::int64_t most_frames, const std::string& source) {
  ClipEntry out;
  out.name = get_text(in, last.name);
  const std::int64_t number = last.skeleton + in.get(skeleton_number);
  if (number < 0 || number >= static_cast<std::int64_t>(skeletons.size())) in.damaged();
  out.skeleton = static_cast<int>(number);
  out.rate_hz = in.get_between(0, 1, rate_number) == 1 ? get_number<double>(in) : last.rate_hz;
  if (!(out.rate_hz > 1e-6 && out.rate_hz < 1e9)) in.damaged();
  constexpr std::int64_t farthest = 1 << 24;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int64_t position = last.placement.position[k] + in.get_between(-2 * farthest, 2 * farthest, place);
    if (std::abs(position) > farthest) in.damaged();
    out.placement.position[k] = static_cast<std::int32_t>(position);
  }
  out.placement.heading =
      static_cast<std::int32_t>(last.placement.heading + in.get_between(-(1 << 20), 1 << 20, heading));
  if (std::abs(out.placement.heading) > (1 << 20)) in.damaged();
  get_blocks(in, out, last.blocks.empty() ? 0 : last.blocks.back(), most_frames);
  const std::int64_t side_size = in.get_between(0, most_side_bytes, side);
  Bytes side_tracks;
  for (std::int64_t i = 0; i < side_size; ++i) {
    side_tracks.push_back(static_cast<std::byte>(in.get_byte(static_cast<std::uint8_t>(i % 8))));
  }
  if (!side_tracks.empty()) {
    out.side_tracks =
        unpack_side_tracks(side_tracks, out.frames, skeletons[static_cast<std::size_t>(out.skeleton)], source);
  }
  return out;
}

bool equal(const Skeleton& a, const Skeleton& b) {
  const auto near = [](const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
    return x.cast<float>() == y.cast<float>();
  };
  if (!a.same_tree(b)) return false;
  for (std::size_t j = 0; j < a.joints.size(); ++j) {
    const auto& ea = a.joints[j].end_site;
    const auto& eb = b.joints[j].end_site;
    if (!near(a.joints[j].offset, b.joints[j].offset)) return false;
    if (ea.has_value() != eb.has_value() || (ea && !near(*ea, *eb))) return false;
  }
  return true;
}

void put_skeletons(IntegerWriter& out, std::span<const Skeleton> skeletons, std::span<const Skeleton> known) {
  out.put(static_cast<std::int64_t>(skeletons.size()), count);
  for (std::size_t s = 0; s < skeletons.size(); ++s) {
    if (!known.empty()) {
      const auto at = std::ranges::find_if(known, [&](const Skeleton& one) { return equal(one, skeletons[s]); });
      out.put(at == known.end() ? 0 : at - known.begin() + 1, skeleton_number);
      if (at != known.end()) continue;
    }
    put_skeleton(out, skeletons[s], s > 0 ? &skeletons[s - 1] : nullptr);
  }
}

// What the adaptive code says is bounded by its size: `left_to_say` counts joints and names together.
std::vector<Skeleton> get_skeletons(IntegerReader& in, std::int64_t most, std::int64_t& left_to_say,
                                    std::span<const Skeleton> known) {
  std::vector<Skeleton> out;
  const std::int64_t skeletons = in.get_between(1, most, count);
  for (std::int64_t s = 0; s < skeletons; ++s) {
    const std::int64_t number =
        known.empty() ? 0 : in.get_between(0, static_cast<std::int64_t>(known.size()), skeleton_number);
    if (number > 0) {
      out.push_back(known[static_cast<std::size_t>(number) - 1]);
    } else {
      out.push_back(get_skeleton(in, s > 0 ? &out.back() : nullptr));
    }
    if (!out.front().same_tree(out.back())) in.damaged();
    left_to_say -= 16 * out.back().joint_count();
    if (left_to_say < 0) in.damaged();
  }
  return out;
}

}  // namespace

void ClipEntry::cut_evenly() {
  blocks.clear();
  for (int left = frames; left > 0; left -= longest_block) blocks.push_back(std::min(left, longest_block));
  finer.assign(blocks.size(), 0);
}

ClipTable clip_table_of(std::span<const Clip> clips) {
  ClipTable out;
  for (const Clip& clip : clips) {
    ClipEntry entry{.name = clip.name,
                    .skeleton = out.add_skeleton(clip.skeleton, clip.name),
                    .rate_hz = clip.rate_hz,
                    .frames = clip.frames};
    entry.cut_evenly();
    out.clips.push_back(std::move(entry));
  }
  parallel_for(std::size_t{0}, clips.size(),
               [&](std::size_t c) { out.clips[c].side_tracks = side_tracks_of(clips[c]); });
  return out;
}

std::int64_t ClipTable::frames() const {
  std::int64_t sum = 0;
  for (const ClipEntry& clip : clips) sum += clip.frames;
  return sum;
}

int ClipTable::add_skeleton(const Skeleton& skeleton, const std::string& clip) {
  if (!skeletons.empty() && !skeletons.front().same_tree(skeleton)) {
    throw Error(ErrorKind::usage, {.file = clip,
                                   .found = "a skeleton of another tree than the clips before",
                                   .expected = "clips of one skeleton in a stream",
                                   .remedy = "encode them into a stream of their own"});
  }
  if (skeleton.rotating_joints().empty() || skeleton.rotating_joints().size() > most_rotating_joints) {
    throw Error(ErrorKind::usage, {.file = clip,
                                   .found = std::to_string(skeleton.rotating_joints().size()) + " rotating joints",
                                   .expected = "1 to " + std::to_string(most_rotating_joints)});
  }
  // From the back: clips of one person come together.
  for (std::size_t i = skeletons.size(); i-- > 0;) {
    if (equal(skeletons[i], skeleton)) return static_cast<int>(i);
  }
  skeletons.push_back(skeleton);
  return static_cast<int>(skeletons.size()) - 1;
}

Bytes pack_skeletons(std::span<const Skeleton> skeletons) {
  IntegerWriter out;
  put_skeletons(out, skeletons, {});
  return std::move(out).finish();
}

std::vector<Skeleton> unpack_skeletons(std::span<const std::byte> bytes, const std::string& source) {
  IntegerReader in(bytes, source);
  std::int64_t left_to_say = 65536 + 16 * static_cast<std::int64_t>(bytes.size());
  std::vector<Skeleton> out = get_skeletons(in, static_cast<std::int64_t>(bytes.size()), left_to_say, {});
  in.expect_end();
  return out;
}

Bytes pack_clip_table(const ClipTable& table, std::span<const Skeleton> known) {
  IntegerWriter out;
  put_skeletons(out, table.skeletons, known);
  out.put(static_cast<std::int64_t>(table.clips.size()), count);
  const ClipEntry none;
  for (std::size_t c = 0; c < table.clips.size(); ++c) put_clip(out, table.clips[c], c > 0 ? table.clips[c - 1] : none);
  return std::move(out).finish();
}

ClipTable unpack_clip_table(std::span<const std::byte> bytes, std::int64_t most_frames, const std::string& source,
                            std::span<const Skeleton> known) {
  IntegerReader in(bytes, source);
  ClipTable out;
  std::int64_t left_to_say = 65536 + 16 * static_cast<std::int64_t>(bytes.size());
  out.skeletons = get_skeletons(in, static_cast<std::int64_t>(bytes.size()), left_to_say, known);
  const std::int64_t clips = in.get_between(1, most_frames, count);
  const ClipEntry none;
  std::int64_t left = most_frames;
  for (std::int64_t c = 0; c < clips; ++c) {
    const ClipEntry& last = c > 0 ? out.clips.back() : none;
    ClipEntry clip = get_clip(in, last, out.skeletons, left, source);
    left -= clip.frames;
    left_to_say -= static_cast<std::int64_t>(clip.name.size());
    if (left_to_say < 0) in.damaged();
    out.clips.push_back(std::move(clip));
  }
  in.expect_end();
  return out;
}

}  // namespace kinespace
