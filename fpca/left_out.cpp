#include "kinespace/fpca/left_out.h"

#include <algorithm>

namespace kinespace {
namespace {

constexpr int ends = 2;          // rows of scores before those of functions
constexpr int place_curves = 3;  // of the root

}  // namespace

LeftOut::LeftOut(const RegisteredSpace& space) {
  for (int c = 0; c < space.curves(); ++c) group_of_.push_back(space.plain().group_of(c));
  for (const MotionSpace& set : space.sets()) {
    Set& out = sets_.emplace_back();
    out.points = set.points();
    for (int level = 0; level <= space.levels(); ++level) out.rows_at.push_back(set.rows_at(level));
    for (const FunctionGroup& group : set.groups()) out.functions.emplace_back(SampleMatrix(group.functions));
  }
}

// At a time of a sequence, by curve.
Eigen::RowVectorXd LeftOut::left_out(const EncodedSequence& sequence, double own_time, int level) const {
  Eigen::RowVectorXd out = Eigen::RowVectorXd::Zero(sequence.scores.cols());
  const Set& set = sets_[static_cast<std::size_t>(sequence.cycles)];
  const int kept =
      set.rows_at[static_cast<std::size_t>(std::min(sequence.level(level), static_cast<int>(set.rows_at.size()) - 1))];
  const Eigen::Index rest = sequence.scores.rows() - std::max(kept, ends);
  const auto described = [&](const UniformSpline& functions) {
    return functions.curves() <= sequence.scores.rows() - ends;
  };
  if (rest <= 0 || !std::ranges::all_of(set.functions, described)) return out;
  const double x = sequence.warp.space_time(own_time) * (set.points - 1);
  std::vector<Eigen::RowVectorXd> values;
  for (const UniformSpline& functions : set.functions) {
    values.emplace_back(Eigen::RowVectorXd::Zero(sequence.scores.rows() - ends));
    functions.value(x, values.back().head(functions.curves()));
  }
  if (values.size() == 1) {
    const auto curves = out.size() - place_curves;
    out.tail(curves) += values.front().tail(rest) * sequence.scores.bottomRightCorner(rest, curves).cast<double>();
    return out;
  }
  for (Eigen::Index c = place_curves; c < out.size(); ++c) {
    const auto group = static_cast<std::size_t>(group_of_[static_cast<std::size_t>(c)]);
    out(c) += values[group].tail(rest).dot(sequence.scores.col(c).tail(rest).cast<double>());
  }
  return out;
}

void LeftOut::correct(const EncodedSequence& before, const EncodedSequence& after, int level,
                      CutCorrection& correction) const {
  const int frames_before = before.last - before.first;
  const int frames_after = after.last - after.first;
  if (level < 0 || frames_before < 1 || frames_after < 1) {
    correction.slope_before = correction.slope_after = Eigen::RowVectorXd::Zero(before.scores.cols());
    return;
  }
  correction.slope_before = -left_out(before, 1 - 1.0 / frames_before, level);
  correction.slope_after = -left_out(after, 1.0 / frames_after, level);
}

}  // namespace kinespace
