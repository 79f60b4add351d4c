// The stream of the qbc codec:
//
//   clips    names, skeletons, rates, lengths, side tracks (codecs/stream/clip_table.h)
//   curves   length and bytes of the joints' channels (codecs/stream/joint_channels.h); length and bytes of the table of
//            curves; the curves, clip by clip and joint by joint. Joints that never turn have none
//
// The table: the interval of the common breaks, the quantiser step and the root's unit; of each curve how much finer
// its step is, log2 of the grid that its breaks stand on, and how many bytes it has. Private to this folder.
#pragma once

#include <string>
#include <vector>

#include "kinespace/codecs/qbc/detail/curve_code.h"
#include "kinespace/codecs/stream/clip_table.h"
#include "kinespace/codecs/stream/joint_channels.h"

namespace kinespace {

struct QbcCurve {
  int finer = 0;     // quarters of an octave
  int grid_log = 1;  // breaks stand on multiples of 2^so many frames
  Bytes code;        // encoder
};

struct QbcTables {
  static constexpr int finest = 400;
  int interval = 160;
  int step_index = 0;
  float root_unit = 5.6444F;  // cm

  [[nodiscard]] CurveShape shape(int frames, int dimensions, int finer, int grid_log) const {
    return {.frames = frames,
            .dimensions = dimensions,
            .interval = interval,
            .grid = 1 << grid_log,
            .step_index = step_index + finer};
  }
};

// 0: the joint has no curve.
[[nodiscard]] inline int curve_dimensions(const ChannelLayout& layout, std::size_t joint) {
  return layout.joints[joint].turns + (joint == 0 ? 3 : 0);
}

// `curves`: [clip][joint that has one].
[[nodiscard]] Bytes pack_curves(const QbcTables& tables, const ChannelLayout& layout, std::span<const QbcCurve> curves);

struct QbcCurveView {
  int finer = 0;
  int grid_log = 1;
  std::span<const std::byte> code;
};
struct QbcCurves {
  QbcTables tables;
  ChannelLayout layout;
  std::vector<QbcCurveView> curves;  // [clip][joint], empty where there is none
};
// Throws Error{bad_input} naming `source`.
[[nodiscard]] QbcCurves unpack_curves(std::span<const std::byte> bytes, const ClipTable& clips,
                                      const std::string& source);

}  // namespace kinespace
