#include "kinespace/codecs/stream/target_search.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace kinespace {
namespace {

// What was reached over what was asked for: met when at most 1.
double ratio_of(const CodecTarget& target, const CodedAttempt& attempt) {
  if (target.bytes) return static_cast<double>(attempt.stream.size()) / static_cast<double>(*target.bytes);
  if (target.mean_error_cm) return attempt.error.mean_joint_error_cm / *target.mean_error_cm;
  return attempt.error.max_joint_error_cm / *target.max_error_cm;
}

// All in logarithms, in which errors and sizes are nearly straight lines over the coarseness.
class Bracket {
 public:
  explicit Bracket(bool bytes) : slope_(bytes ? -1.4 : 1.1), aim_(std::log(bytes ? 0.996 : 0.993)) {}

  void tell(double coarseness, double ratio) {
    const bool met = ratio <= 0;
    in_a_row_ = met == last_met_ ? in_a_row_ + 1 : 1;
    last_met_ = met;
    std::optional<Side>& side = met ? met_ : missed_;
    const bool coarser_is_nearer = met == (slope_ > 0);
    if (!side || (coarseness > side->coarseness) == coarser_is_nearer) side = {coarseness, ratio};
  }

  [[nodiscard]] bool narrow() const {
    return met_ && missed_ && std::abs(met_->coarseness - missed_->coarseness) < 0.002;
  }

  // Where errors or sizes jump, the target may be met once more beyond the jump.
  [[nodiscard]] double beyond(int times) const { return met_->coarseness + (slope_ > 0 ? 0.1 : -0.1) * times; }

  // After one at which the ratio was so: on the line between both sides, kept off its ends; else onwards by what the ratio
  // asks, and after some of these by twice as much each time: most of a stream, or of an error, may not depend on it.
  [[nodiscard]] double next(double coarseness, double ratio) const {
    if (met_ && missed_) {
      const double share = missed_->ratio > met_->ratio
                               ? std::clamp((aim_ - met_->ratio) / (missed_->ratio - met_->ratio), 0.08, 0.92)
                               : 0.5;
      return met_->coarseness + share * (missed_->coarseness - met_->coarseness);
    }
    const double asked = std::clamp(std::abs((aim_ - ratio) * slope_), 0.02, 2.0);
    const double onwards = std::min(asked * std::exp2(std::max(0, in_a_row_ - patience)), 3.0);
    return coarseness + ((ratio <= 0) == (slope_ > 0) ? onwards : -onwards);
  }

 private:
  struct Side {
    double coarseness = 0, ratio = 0;
  };
  static constexpr int patience = 6;
  double slope_, aim_;  // of the coarseness over the ratio; the ratio to come to
  std::optional<Side> met_, missed_;
  bool last_met_ = false;
  int in_a_row_ = 0;
};

}  // namespace

Bytes search_target(const CodecTarget& target, const SearchRange& range,
                    const std::function<CodedAttempt(double)>& attempt) {
  const bool bytes = target.bytes.has_value();
  Bytes best;
  // The log of what was reached over what was asked for.
  const auto ratio_at = [&](double coarseness) {
    CodedAttempt made = attempt(coarseness);
    const double ratio = ratio_of(target, made);
    const bool better = best.empty() || (bytes ? made.stream.size() > best.size() : made.stream.size() < best.size());
    if (ratio <= 1 && better) best = std::move(made.stream);
    return std::log(std::max(ratio, 1e-6));
  };
  const double least = std::log(range.least), most = std::log(range.most);
  Bracket bracket(bytes);
  double coarseness = std::log(range.start);
  for (int round = 0, since_met = 0; round < 2 * range.rounds && since_met < range.rounds; ++round) {
    const double ratio = ratio_at(std::exp(coarseness));
    const bool met = ratio <= 0;
    if (met && ratio >= std::log(range.close)) return best;
    since_met += best.empty() ? 0 : 1;
    const bool to_coarser = met != bytes;
    if (to_coarser ? coarseness >= most : coarseness <= least) break;
    bracket.tell(coarseness, ratio);
    if (bracket.narrow()) {
      for (const int times : {1, 2, 3}) {
        const double there = std::clamp(bracket.beyond(times), least, most);
        const double found = ratio_at(std::exp(there));
        if (found <= 0 && found >= std::log(range.close)) break;
      }
      break;
    }
    coarseness = std::clamp(bracket.next(coarseness, ratio), least, most);
  }
  // Errors that jump (where inverse kinematics puts a joint elsewhere) may keep to the target by chance alone.
  for (const double off : {-0.03, 0.03, -0.06, 0.06, -0.1, 0.1, -0.16, 0.16, -0.25, 0.25}) {
    if (!best.empty() || bytes) break;
    static_cast<void>(ratio_at(range.start * std::exp(off)));
  }
  if (best.empty()) cannot_meet(target);
  return best;
}

}  // namespace kinespace
