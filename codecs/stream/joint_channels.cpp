#include "kinespace/codecs/stream/joint_channels.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/stream/detail/joint_turns.h"
#include "kinespace/entropy/range_coder.h"

namespace kinespace {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Base {
  Quaterniond turn = Quaterniond::Identity();
  Vector3d position = Vector3d::Zero();
};

// The joints above the travel root, from joint 0 down.
std::vector<int> joints_above(const Skeleton& skeleton) {
  std::vector<int> out;
  const auto parent = [&](int j) { return skeleton.joints[static_cast<std::size_t>(j)].parent; };
  for (int j = parent(skeleton.travel_root()); j >= 0; j = parent(j)) out.insert(out.begin(), j);
  return out;
}

Base base_of(const Clip& clip, const std::vector<int>& above, int frame) {
  Base out;
  for (const int j : above) {
    out.position += out.turn * clip.translation(j, frame);
    out.turn = out.turn * clip.rotation(j, frame);
  }
  return out;
}

// Plain products and sums: what reaches a decoded clip must not depend on how Eigen was compiled.
Quaterniond unit(double w, double x, double y, double z) {
  const double norm = std::sqrt(((w * w + x * x) + y * y) + z * z);
  if (!(norm > 0)) return Quaterniond::Identity();
  return {w / norm, x / norm, y / norm, z / norm};
}

constexpr int turn_count_bits = 2;
constexpr int bit_count_bits = 5;
constexpr int middle_bits = 28;

void put_bits(RangeEncoder& out, std::uint32_t value, int bits) {
  for (int i = bits - 1; i >= 0; --i) out.encode_even(((value >> i) & 1U) != 0);
}

std::uint32_t get_bits(RangeDecoder& in, int bits) {
  std::uint32_t out = 0;
  for (int i = 0; i < bits; ++i) out = (out << 1) | (in.decode_even() ? 1U : 0U);
  return out;
}

[[noreturn]] void damaged(const std::string& source) {
  throw Error(ErrorKind::bad_input, {.file = source,
                                     .found = "a table of joints that ends too early or too late",
                                     .expected = "what the encoder writes (damaged)"});
}

// A number of models that depends on nothing but the build, so that streams are alike.
struct LayoutModels {
  std::array<AdaptiveBit, 4> turns;
  AdaptiveBit undoes;
  AdaptiveBit middle;
  std::array<std::array<AdaptiveBit, 1U << bit_count_bits>, 4> bits;
};

template <typename Coder>
int code_tree(Coder& coder, AdaptiveBit* tree, int bits, int value) {
  std::size_t node = 1;
  for (int i = bits - 1; i >= 0; --i) {
    bool bit = ((value >> i) & 1) != 0;
    if constexpr (std::is_same_v<Coder, RangeEncoder>) {
      coder.encode(bit, tree[node]);
    } else {
      bit = coder.decode(tree[node]);
    }
    node = 2 * node + (bit ? 1 : 0);
  }
  return static_cast<int>(node) - (1 << bits);
}

void put_turn(RangeEncoder& out, const GridTurn& turn, AdaptiveBit* tree) {
  code_tree(out, tree, bit_count_bits, turn.bits);
  if (turn.bits == 0) return;
  put_bits(out, static_cast<std::uint32_t>(turn.largest), 2);
  const std::int32_t middle = 1 << turn.bits;
  for (const std::int32_t s : turn.steps) put_bits(out, static_cast<std::uint32_t>(s + middle), turn.bits + 1);
}

GridTurn get_turn(RangeDecoder& in, AdaptiveBit* tree, const std::string& source) {
  GridTurn out{.bits = code_tree(in, tree, bit_count_bits, 0)};
  if (out.bits == 1 || out.bits > GridTurn::most_bits) damaged(source);
  if (out.bits == 0) return out;
  out.largest = static_cast<int>(get_bits(in, 2));
  for (std::int32_t& s : out.steps) s = static_cast<std::int32_t>(get_bits(in, out.bits + 1)) - (1 << out.bits);
  return out;
}

}  // namespace

GridTurn GridTurn::nearest(const Quaterniond& q, int bits) {
  GridTurn out{.bits = bits};
  const std::array<double, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
  for (int k = 1; k < 4; ++k) {
    if (std::abs(wxyz[static_cast<std::size_t>(k)]) > std::abs(wxyz[static_cast<std::size_t>(out.largest)])) {
      out.largest = k;
    }
  }
  const double sign = wxyz[static_cast<std::size_t>(out.largest)] < 0 ? -1 : 1;
  const double steps = std::ldexp(1.0, bits);
  for (std::size_t k = 0, at = 0; k < 4; ++k) {
    if (static_cast<int>(k) == out.largest) continue;
    out.steps[at++] = static_cast<std::int32_t>(std::lround(sign * wxyz[k] * steps));
  }
  return out;
}

Quaterniond GridTurn::value() const {
  if (bits == 0) return Quaterniond::Identity();
  std::array<double, 4> wxyz{};
  double rest = 1;
  for (std::size_t k = 0, at = 0; k < 4; ++k) {
    if (static_cast<int>(k) == largest) continue;
    wxyz[k] = std::ldexp(static_cast<double>(steps[at++]), -bits);
    rest -= wxyz[k] * wxyz[k];
  }
  wxyz[static_cast<std::size_t>(largest)] = std::sqrt(std::max(rest, 0.0));
  return unit(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
}

int ChannelLayout::channel_count() const {
  int out = 3;
  for (const JointFreedom& joint : joints) out += joint.turns;
  return out;
}

ChannelCurves channel_curves(const Clip& clip, const ChannelLayout& layout) {
  const auto n = static_cast<std::size_t>(clip.frames);
  ChannelCurves out{.frames = clip.frames};
  out.values.resize(static_cast<std::size_t>(layout.channel_count()) * n);
  const int root = layout.joints.front().joint;
  const std::vector<int> above = joints_above(clip.skeleton);
  for (int f = 0; f < clip.frames; ++f) {
    const Base base = base_of(clip, above, f);
    const Vector3d position = base.position + base.turn * clip.translation(root, f);
    if (!position.allFinite()) {
      throw Error(ErrorKind::bad_input,
                  {.file = clip.name, .found = "a position that is no number", .expected = "finite positions"});
    }
    for (std::size_t k = 0; k < 3; ++k) {
      out.values[k * n + static_cast<std::size_t>(f)] = position[static_cast<Eigen::Index>(k)];
    }
  }
  std::vector<Quaterniond> turns;
  for (const JointFreedom& joint : layout.joints) {
    turns.clear();
    append_turns(clip, joint.joint, turns);
    JointTurns(joint).angles(turns, std::span(out.values)
                                        .subspan(static_cast<std::size_t>(joint.first_channel) * n,
                                                 static_cast<std::size_t>(joint.turns) * n));
  }
  return out;
}

void write_joint_channels(const JointFreedom& freedom, std::span<const double> channels, int first, int count,
                          Clip& clip) {
  const JointTurns rule(freedom);
  const bool travels = freedom.joint == clip.skeleton.travel_root();
  const std::vector<int> above = travels ? joints_above(clip.skeleton) : std::vector<int>{};
  std::vector<Quaterniond> turns(static_cast<std::size_t>(count));
  rule.rotations(channels.first(rule.turns() * turns.size()), turns);
  for (int i = 0; i < count; ++i) {
    const Quaterniond& q = turns[static_cast<std::size_t>(i)];
    clip.set_rotation(freedom.joint, first + i,
                      above.empty() ? q : base_of(clip, above, first + i).turn.conjugate() * q);
  }
}

void write_root_position(std::span<const double> channels, int first, int count, Clip& clip) {
  const auto n = static_cast<std::size_t>(count);
  const int root = clip.skeleton.travel_root();
  const std::vector<int> above = joints_above(clip.skeleton);
  clip.require_translation_track(root);
  for (std::size_t i = 0; i < n; ++i) {
    const int frame = first + static_cast<int>(i);
    const Base base = base_of(clip, above, frame);
    const Vector3d position(channels[i], channels[n + i], channels[2 * n + i]);
    clip.require_translation_track(root).values[static_cast<std::size_t>(frame)] =
        base.turn.conjugate() * (position - base.position);
  }
}

void write_channels(const ChannelLayout& layout, std::span<const double> channels, int first, int count, Clip& clip) {
  const auto n = static_cast<std::size_t>(count);
  write_root_position(channels.first(3 * n), first, count, clip);
  for (const JointFreedom& joint : layout.joints) {
    write_joint_channels(
        joint,
        channels.subspan(static_cast<std::size_t>(joint.first_channel) * n, static_cast<std::size_t>(joint.turns) * n),
        first, count, clip);
  }
}

Bytes pack_layout(const ChannelLayout& layout) {
  RangeEncoder out;
  LayoutModels models;
  for (const JointFreedom& joint : layout.joints) {
    code_tree(out, models.turns.data(), turn_count_bits, joint.turns);
    AdaptiveBit* tree = models.bits[static_cast<std::size_t>(joint.turns)].data();
    put_turn(out, joint.before, tree);
    if (joint.turns == 0) continue;
    out.encode(joint.after_undoes, models.undoes);
    if (!joint.after_undoes) put_turn(out, joint.after, tree);
    if (joint.turns != 2) continue;
    out.encode(joint.middle_degrees != 0, models.middle);
    if (joint.middle_degrees == 0) continue;
    const auto steps = static_cast<std::int32_t>(std::lround(joint.middle_degrees * (1 << 20)));
    put_bits(out, static_cast<std::uint32_t>(steps + (1 << (middle_bits - 1))), middle_bits);
  }
  return std::move(out).finish();
}

ChannelLayout unpack_layout(std::span<const std::byte> bytes, const Skeleton& skeleton, const std::string& source) {
  RangeDecoder in(bytes);
  LayoutModels models;
  ChannelLayout out;
  int next = 3;
  for (const int j : skeleton.rotating_joints()) {
    JointFreedom joint{.joint = j, .turns = code_tree(in, models.turns.data(), turn_count_bits, 0)};
    AdaptiveBit* tree = models.bits[static_cast<std::size_t>(joint.turns)].data();
    joint.before = get_turn(in, tree, source);
    if (joint.turns > 0) {
      joint.after_undoes = in.decode(models.undoes);
      if (!joint.after_undoes) joint.after = get_turn(in, tree, source);
    }
    if (joint.turns == 2 && in.decode(models.middle)) {
      const auto steps = static_cast<std::int32_t>(get_bits(in, middle_bits)) - (1 << (middle_bits - 1));
      joint.middle_degrees = static_cast<double>(steps) / (1 << 20);
    }
    joint.first_channel = next;
    next += joint.turns;
    if (in.overrun()) damaged(source);
    out.joints.push_back(joint);
  }
  if (!in.used_up()) damaged(source);
  return out;
}

void require_channels_below(double most, const ChannelCurves& curves, const std::string& clip) {
  for (const double v : curves.values) {
    if (std::abs(v) < most) continue;
    throw Error(ErrorKind::bad_input,
                {.file = clip,
                 .found = fmt::format("a root farther than {:.0f} km away, or a joint that turned {:.0f} times",
                                      most / 1e5, std::floor(most / 360)),
                 .expected = "positions in centimetres and rotations"});
  }
}

}  // namespace kinespace
