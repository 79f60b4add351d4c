// What each joint can do, found from its motion: hinge, universal joint, any turn; and a clip as channels of that.
//
// A clip knows local rotations R_t, not which axes of which frame the recording's skeleton turned about. A knee that
// turns about one oblique axis moves all three of its Euler channels. Here a joint's freedom is two constant turns A
// (before) and B (after) and a number of turns such that, to a tolerance, in every frame of every clip
//
//   R_t = A Rz(a_t) Ry(b_t) Rx(c_t) B
//
//   turns  moves    found as
//   0      -        R_t = A
//   1      a        all R_t R_0^-1 about one axis: the direction u in which R_t' u varies least
//   2      a, c     u' R_t v is constant for a parent-side axis u and a child-side axis v: linear in u (x) v, so the
//                   least eigenvector of rank one of the 9 x 9 covariance of R_t; b stays at -asin(u' R_t v)
//   3      a, b, c  always possible. A and B put the middle angle as near to zero as it goes (u (x) v of least mean
//                   square), far from the +-90 degrees where a and c are ill defined, and the mean pose at zero
//
// Fewer turns are taken only when every frame is kept (ChannelSearch::tolerance_degrees, checked by rebuilding it).
//
// Channels: 0, 1, 2 the world position of the travel root in cm; then those of the rotating joints
// (Skeleton::rotating_joints(), the travel root first and in the world) in degrees, continuous in time: angles go on
// beyond +-180, and through a pole. Joints above the travel root and translations of other joints are side tracks
// (motion/curves.h).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "kinespace/base/bytes.h"
#include "kinespace/motion/clip.h"

namespace kinespace {

// A rotation on a grid, so that storing it loses nothing: the quaternion's largest number is left out (it follows from
// unit length, and is positive), the others are whole steps of 2^-bits.
struct GridTurn {
  static constexpr int most_bits = 28;
  int bits = 0;  // 0: the identity; else 2 to most_bits
  int largest = 0;
  std::array<std::int32_t, 3> steps{};

  [[nodiscard]] static GridTurn nearest(const Eigen::Quaterniond& q, int bits);
  [[nodiscard]] Eigen::Quaterniond value() const;
};

struct JointFreedom {
  int joint = 0;  // index into Skeleton::joints
  int turns = 0;
  GridTurn before;            // A
  GridTurn after;             // B, unless it is A's inverse
  bool after_undoes = false;  // B = A^-1, as where a skeleton file gives a joint one frame of axes
  double middle_degrees = 0;  // b of two turns whose axes are not at right angles; on a grid of 2^-20
  int first_channel = 0;      // its channels are [first_channel, first_channel + turns): a; a c; a b c

  [[nodiscard]] Eigen::Quaterniond turn_before() const { return before.value(); }
  [[nodiscard]] Eigen::Quaterniond turn_after() const {
    return after_undoes ? before.value().conjugate() : after.value();
  }
};

struct ChannelLayout {
  std::vector<JointFreedom> joints;  // one for each of Skeleton::rotating_joints()

  // Three positions and all turns.
  [[nodiscard]] int channel_count() const;
};

struct ChannelSearch {
  double tolerance_degrees = 0.01;  // how far any frame may be off for a joint to get fewer turns; 1e-5 to 10
  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

// Of clips of one tree (Skeleton::same_tree). Throws Error{bad_input} naming the clip when a value is no number,
// Error{usage} when there are no clips or trees differ.
[[nodiscard]] ChannelLayout find_channel_layout(std::span<const Clip> clips, const ChannelSearch& search = {});
// The same for clips here and there.
[[nodiscard]] ChannelLayout find_channel_layout(std::span<const Clip* const> clips, const ChannelSearch& search = {});

struct ChannelCurves {
  int frames = 0;
  std::vector<double> values;  // [channel][frame]; cm and degrees

  [[nodiscard]] std::span<const double> channel(int c) const& {
    return {values.data() + static_cast<std::size_t>(c) * static_cast<std::size_t>(frames),
            static_cast<std::size_t>(frames)};
  }
  std::span<const double> channel(int c) const&& = delete;  // of what is gone with the statement
};

// The channels of a clip whose joints move as the layout says (what else they do is lost). Throws Error{bad_input} when
// a value is no number.
[[nodiscard]] ChannelCurves channel_curves(const Clip& clip, const ChannelLayout& layout);

// One joint's frames [first, first + count) of `clip` from its channels: `channels` holds `turns` columns of `count`
// degrees (none for a joint that never turns). The travel root too, in the world: what stands above it must be in place
// (apply_side_track). Gives the same bits on every machine.
void write_joint_channels(const JointFreedom& freedom, std::span<const double> channels, int first, int count,
                          Clip& clip);
// The travel root's position from three columns of cm in the world.
void write_root_position(std::span<const double> channels, int first, int count, Clip& clip);
// Frames [first, first + count) of the whole clip: `channels` is [channel][count]. The clip's skeleton is of the tree
// that the layout was found for, and has its side tracks in place.
void write_channels(const ChannelLayout& layout, std::span<const double> channels, int first, int count, Clip& clip);

// The layout as bytes: some 4 bytes for a joint of three turns, 9 for others.
[[nodiscard]] Bytes pack_layout(const ChannelLayout& layout);
// Throws Error{bad_input} naming `source`.
[[nodiscard]] ChannelLayout unpack_layout(std::span<const std::byte> bytes, const Skeleton& skeleton,
                                          const std::string& source);

// Channels beyond this, in cm or degrees, are damage to most readers.
inline constexpr double largest_channel_value = 1e7;
// Throws Error{bad_input} naming the clip when a channel is as large as `most`, or no number.
void require_channels_below(double most, const ChannelCurves& curves, const std::string& clip);

}  // namespace kinespace
