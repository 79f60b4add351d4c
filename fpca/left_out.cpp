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

// What is left out at a time of a sequence, added to `out`.
void LeftOut::add_beside(const EncodedSequence& sequence, double own_time, int level, Eigen::RowVectorXd& out) const {
  const Set& set = sets_[static_cast<std::size_t>(sequence.cycles)];
  const int kept =
      set.rows_at[static_cast<std::size_t>(std::min<int>(level, static_cast<int>(set.rows_at.size()) - 1))];
  const Eigen::Index rest = sequence.scores.rows() - std::max(kept, ends);
  const auto described = [&](const UniformSpline& functions) {
    return functions.curves() <= sequence.scores.rows() - ends;
  };
  if (rest <= 0 || !std::ranges::all_of(set.functions, described)) return;
  const double x = sequence.warp.space_time(own_time) * (set.points - 1);
  std::vector<Eigen::RowVectorXd> values;
  for (const UniformSpline& functions : set.functions) {
    values.emplace_back(Eigen::RowVectorXd::Zero(sequence.scores.rows() - ends));
    functions.value(x, values.back().head(functions.curves()));
  }
  if (values.size() == 1) {
    const auto curves = out.size() - place_curves;
    out.tail(curves) += values.front().tail(rest) * sequence.scores.bottomRightCorner(rest, curves).cast<double>();
    return;
  }
  for (Eigen::Index c = place_curves; c < out.size(); ++c) {
    const auto group = static_cast<std::size_t>(group_of_[static_cast<std::size_t>(c)]);
    out(c) += values[group].tail(rest).dot(sequence.scores.col(c).tail(rest).cast<double>());
  }
}

Eigen::RowVectorXd LeftOut::slope(const EncodedSequence& left, const EncodedSequence& right, int level) const {
  Eigen::RowVectorXd missing = Eigen::RowVectorXd::Zero(left.scores.cols());
  const int before = left.last - left.first;
  const int after = right.last - right.first;
  if (level < 0 || before < 1 || after < 1) return missing;
  add_beside(left, 1 - 1.0 / before, level, missing);
  add_beside(right, 1.0 / after, level, missing);
  return -missing / 2;
}

}  // namespace kinespace
