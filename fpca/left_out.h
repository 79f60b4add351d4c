// What the functions that a level of detail leaves out would add in the frames beside a cut: by so much its slopes there
// differ from those of the motion.
//
// In a pinned space neighbours agree at their cut at every level, but their slopes agree only with all functions. The
// scores say by how much they do not, so a coarse level can be given the very slopes that the motion has on both sides:
// nothing is guessed, and with all functions nothing is changed.
#pragma once

#include <vector>

#include "kinespace/fpca/cut_join.h"
#include "kinespace/fpca/encoding.h"

namespace kinespace {

class LeftOut {
 public:
  explicit LeftOut(const RegisteredSpace& space);

  // Sets the slopes of the correction (fpca/cut_join.h) between two neighbours of a run at a level of detail: in the
  // frames beside the cut both are then what they are with all functions. 0 for the root's place: its velocity is kept
  // at the cut, and what functions leave of its travel is spread over the sequence.
  void correct(const EncodedSequence& before, const EncodedSequence& after, int level, CutCorrection& correction) const;

 private:
  struct Set {
    int points = 0;
    std::vector<int> rows_at;              // by level
    std::vector<UniformSpline> functions;  // by group
  };
  [[nodiscard]] Eigen::RowVectorXd left_out(const EncodedSequence& sequence, double own_time, int level) const;

  std::vector<Set> sets_;
  std::vector<int> group_of_;  // by curve
};

}  // namespace kinespace
