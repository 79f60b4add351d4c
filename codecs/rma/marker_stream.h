// What a stream of the paper's profile holds, as whole numbers: groups, clips, control points, alignment, contacts
// (lin2011, section 5.4), and its bytes.
//
//   mean postures   in 0.01 cm (the paper: 16 bits)
//   axes            in 1/2048 (12 bits)
//   control points  by equation 7 (adaptive_bits.h), each curve with its own minimum in 1/256 of the axis' range (8
//                   bits), of repeated clips in 1/64 (6 bits)
//   alignment       control points in 1 mm and 1/512 rad (16 bits hold 60 m and 20 turns)
//   references      differences between control points, straight lines between them
//
// The paper's RAR stage is the adaptive range coder: what is coded of a control point is its difference to the one
// before, with the axis, the kind of clip and the size of the difference before as context.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/codecs/rma/contact_trajectories.h"
#include "kinespace/codecs/rma/root_alignment.h"
#include "kinespace/codecs/stream/clip_table.h"

namespace kinespace {

// How the coefficients along one axis are quantised.
struct AxisSteps {
  int range = 0;  // in sixteenths of an octave of 1 cm; the range is 2^(range / 16)
  int bits = 0;   // of equation 8
  [[nodiscard]] double range_cm() const;
  [[nodiscard]] double step_cm() const;
  // Of the curves' minima; `bits`: 8 or 6.
  [[nodiscard]] double minimum_step_cm(int minimum_bits) const;
  [[nodiscard]] static int range_code(double range_cm);  // the least that holds it
};

struct MarkerGroup {
  static constexpr double mean_step_cm = 0.01;
  static constexpr double axis_steps = 2048;
  std::vector<std::int32_t> mean;               // [dimension]
  std::vector<std::int16_t> axes;               // [axis][dimension]
  std::array<std::vector<AxisSteps>, 2> steps;  // [0: primary and unique, 1: repeated][axis]
  [[nodiscard]] int axis_count() const { return static_cast<int>(steps[0].size()); }
};

// A curve: control points at the regular frames and those that were added.
struct CurveCode {
  std::int32_t minimum = 0;
  std::vector<std::int32_t> added;   // frames, ascending
  std::vector<std::int32_t> values;  // by control point
};

// A clip of the analysis.
struct MarkerClip {
  enum class Kind : std::uint8_t { primary, repeated, unique };
  Kind kind = Kind::unique;
  int group = 0;
  int frames = 0;
  int primary = -1;                     // repeated: index of its primary clip
  std::vector<std::int32_t> reference;  // repeated: frames of the primary clip at the regular frames of reference_span
  std::vector<CurveCode> curves;        // by axis
  [[nodiscard]] bool repeats() const { return kind == Kind::repeated; }
};

struct RootCode {
  static constexpr std::array<double, 7> step{0.1, 0.1, 0.1, 1.0 / 512, 1.0 / 512, 1.0 / 512, 1.0 / 512};
  int degrees = 4;
  int frames = 0;
  std::vector<CurveCode> curves;  // no minimum
};

struct MarkerStream {
  int span = 8;             // frames between regular control points, 1 to 512
  int root_span = 16;       // likewise, of the alignment
  int reference_span = 16;  // likewise, of references
  int seam_limit_cm_s = 0;  // of seam_easing.h, 0 to most_seam_limit
  ReferencePose reference;
  std::vector<MarkerGroup> groups;
  std::vector<MarkerClip> clips;                   // in time: together all frames of all input clips
  std::vector<RootCode> roots;                     // by input clip
  std::vector<std::vector<ContactCode>> contacts;  // by input clip
};

// Of a frame of markers of clips of that tree: three of the root, six a rotating joint.
[[nodiscard]] int marker_dimensions(const ClipTable& table);
[[nodiscard]] std::int64_t numbers_in(const MarkerStream& stream);

[[nodiscard]] Bytes pack_marker_stream(const MarkerStream& stream);
// Throws Error{bad_input} naming `source`. `numbers`: at most so many are believed.
[[nodiscard]] MarkerStream unpack_marker_stream(std::span<const std::byte> bytes, const ClipTable& table,
                                                int dimensions, std::int64_t numbers, const std::string& source);

// Shared with other streams of markers.
void put_reference_pose(ValueWriter& out, const ReferencePose& pose, int context);
[[nodiscard]] ReferencePose get_reference_pose(ValueReader& in, int joints, int context);
// An alignment; takes contexts [context, context + root_contexts).
inline constexpr int root_contexts = 1 + 7 * 10;
void put_root(ValueWriter& out, const RootCode& root, int span, int context);
[[nodiscard]] RootCode get_root(ValueReader& in, int frames, int span, int context, std::int64_t& numbers);
// A curve's control points; takes contexts [context, context + curve_contexts).
inline constexpr int curve_contexts = 10;
void put_curve(ValueWriter& out, const CurveCode& curve, int frames, int span, int context);
// Takes what it holds off `numbers`, and throws when that is not enough.
[[nodiscard]] CurveCode get_curve(ValueReader& in, int frames, int span, int context, std::int64_t& numbers);

}  // namespace kinespace
