// The encoder's choice of frames of the root to correct (codecs/qbc/detail/frame_corrections.h).
//
// Of the file's angles Rz(a) Ry(b) Rx(c) two fly when cos b is small: an error of e degrees about the axis that none of
// them turns about moves a and c by e / |cos b| each. Such frames are few, and can hold most of a clip's mean squared
// error (khan2014, eq. 11). A frame is corrected where that lowers
//
//   squared error of the file's angles + squared error that a bit is worth * bits
//
// with the numbers for which that is least. Only one direction counts there, so that a coarse step with numbers that
// happen to hit it often does. Private to this folder.
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "kinespace/codecs/qbc/detail/curve_code.h"
#include "kinespace/codecs/stream/detail/joint_turns.h"

namespace kinespace {

class PoleCorrections {
 public:
  // `root` is the travel root's.
  PoleCorrections(const Clip& clip, const JointFreedom& root);

  // Of the root's curve, which has none. `task` has its values, the limit and the weight of a bit.
  [[nodiscard]] std::vector<FrameCorrection> choose(const CurveTask& task, const CodedCurve& curve) const;

 private:
  [[nodiscard]] double squared_error(std::size_t frame, const Point& turns) const;

  JointTurns rule_;
  EulerOrder order_;
  std::vector<Eigen::Quaterniond> above_;  // what the root's rotation stands in, backwards
  std::vector<EulerAngles> file_;          // degrees
};

}  // namespace kinespace
