// How far decoded clips are from the originals, summed up over many clips: what a codec writes into its stream's
// header. The measures are those of motion/error_measures.h, weighted by frames times joints.
#pragma once

#include <cstdint>
#include <vector>

#include "kinespace/motion/clip.h"
#include "kinespace/storage/bitstream.h"

namespace kinespace {

// How far one joint of one frame is off, in cm: its position, and its shell.
struct JointError {
  double distance = 0;
  double shell = 0;
};

struct ClipErrorSums {
  double distance = 0;
  double largest = 0;
  double shell = 0;
  std::int64_t count = 0;  // joints times frames

  void add(const ClipErrorSums& other);
  void add(const JointError& joint);
  [[nodiscard]] double mean_cm() const { return count > 0 ? distance / static_cast<double>(count) : 0; }
  [[nodiscard]] double shell_cm() const { return count > 0 ? shell / static_cast<double>(count) : 0; }
  // As 32-bit floats that are not below the measured ones.
  [[nodiscard]] MeasuredError measured() const;
};

// Frames [first, first + count) of clips of the same joints in the same order; frame `first` of `original` against
// frame `decoded_first` of `decoded`.
[[nodiscard]] ClipErrorSums clip_error(const Clip& original, const Clip& decoded, int first, int count,
                                       int decoded_first);
// The same joint by joint, appended to `out`: what is measured in parts and added up in the order of frames is what
// clip_error gives of the whole, to the last bit.
void append_joint_errors(const Clip& original, const Clip& decoded, int first, int count, int decoded_first,
                         std::vector<JointError>& out);

// What ratios of clips are taken of (lin2011, yoo2019): 32-bit floats of three numbers for the root and three for each
// rotating joint, in all frames.
[[nodiscard]] double raw_bytes(const Clip& clip);

}  // namespace kinespace
