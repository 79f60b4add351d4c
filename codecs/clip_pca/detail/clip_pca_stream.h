// What a clip-pca stream holds (arikan 2006 as lin2011, section 6, compares with it), and the way back to clips.
//
// Motion is cut into clips of one length. Of each, every coordinate of three markers per joint (its own place, along,
// across: markers.h) and of the root is a cubic Bezier curve; its four control points a coordinate make one vector,
// [control point][coordinate]. Vectors are clustered, and told by principal components of their cluster.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/codecs/rma/marker_stream.h"
#include "kinespace/codecs/rma/markers.h"
#include "kinespace/codecs/stream/clip_table.h"

namespace kinespace {

struct ClipPcaGroup {
  static constexpr double mean_step_cm = 0.01;
  static constexpr double axis_steps = 8192;
  static constexpr int coefficient_bits = 16;
  std::vector<std::int32_t> mean;  // [control point][coordinate]
  std::vector<std::int16_t> axes;  // [axis][control point][coordinate]
  std::vector<int> range;          // by axis: AxisSteps::range_code of its coefficients' range about zero
  [[nodiscard]] int axis_count() const { return static_cast<int>(range.size()); }
  // Of the quantiser: the range over 2^16.
  [[nodiscard]] double step_cm(std::size_t axis) const;
};

struct ClipPcaPiece {
  int group = 0;
  std::vector<std::int32_t> coefficients;  // by axis, in steps
};

struct ClipPcaStream {
  int length = 24;     // frames of a clip, 2 to 512
  int root_span = 16;  // frames between regular control points of the alignment
  ReferencePose reference;
  std::vector<ClipPcaGroup> groups;
  std::vector<ClipPcaPiece> pieces;                // input clip by input clip, the last of each filled up
  std::vector<RootCode> roots;                     // by input clip
  std::vector<std::vector<ContactCode>> contacts;  // by input clip
};

[[nodiscard]] std::int64_t numbers_in(const ClipPcaStream& stream);
[[nodiscard]] Bytes pack_clip_pca(const ClipPcaStream& stream);
// Throws Error{bad_input} naming `source`. `numbers`: at most so many are believed.
[[nodiscard]] ClipPcaStream unpack_clip_pca(std::span<const std::byte> bytes, const ClipTable& table, int coordinates,
                                            std::int64_t numbers, const std::string& source);

class ClipPcaDecoder {
 public:
  // Both must outlive it.
  ClipPcaDecoder(const ClipTable& table, const ClipPcaStream& stream);
  [[nodiscard]] Clip decode_without_contacts(std::size_t clip) const;
  [[nodiscard]] Clip decode(std::size_t clip) const;

 private:
  [[nodiscard]] std::vector<double> control_points(std::size_t number) const;

  const ClipTable& table_;
  const ClipPcaStream& stream_;
  std::vector<MarkerRig> rigs_;            // by skeleton
  std::vector<std::size_t> first_piece_;   // by input clip
  std::vector<std::vector<double>> axes_;  // by group
};

// The four Bernstein polynomials at frame f of `length`.
[[nodiscard]] std::array<double, 4> bernstein(int frame, int length);

}  // namespace kinespace
