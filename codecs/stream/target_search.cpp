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
    std::optional<Side>& side = ratio <= 0 ? met_ : missed_;
    const bool coarser_is_nearer = (ratio <= 0) == (slope_ > 0);
    if (!side || (coarseness > side->coarseness) == coarser_is_nearer) side = {coarseness, ratio};
  }

  [[nodiscard]] bool narrow() const {
    return met_ && missed_ && std::abs(met_->coarseness - missed_->coarseness) < 0.002;
  }

  // After one at which the ratio was so: on the line between both sides, kept off its ends; else onwards by what the ratio asks.
  [[nodiscard]] double next(double coarseness, double ratio) const {
    if (met_ && missed_) {
      const double share = missed_->ratio > met_->ratio
                               ? std::clamp((aim_ - met_->ratio) / (missed_->ratio - met_->ratio), 0.08, 0.92)
                               : 0.5;
      return met_->coarseness + share * (missed_->coarseness - met_->coarseness);
    }
    const double onwards = (ratio <= 0) == (slope_ > 0) ? 0.02 : -0.02;
    return coarseness + std::clamp((aim_ - ratio) * slope_, -2.0, 2.0) + onwards;
  }

 private:
  struct Side {
    double coarseness = 0, ratio = 0;
  };
  double slope_, aim_;  // of the coarseness over the ratio; the ratio to come to
  std::optional<Side> met_, missed_;
};

}  // namespace

Bytes search_target(const CodecTarget& target, const SearchRange& range,
                    const std::function<CodedAttempt(double)>& attempt) {
  const bool bytes = target.bytes.has_value();
  Bytes best;
  Bracket bracket(bytes);
  double coarseness = range.start;
  for (int round = 0; round < 2 * range.rounds; ++round) {
    CodedAttempt made = attempt(coarseness);
    const double ratio = ratio_of(target, made);
    const bool met = ratio <= 1;
    const bool better = best.empty() || (bytes ? made.stream.size() > best.size() : made.stream.size() < best.size());
    if (met && better) best = std::move(made.stream);
    if (met && ratio >= range.close) break;
    if (!best.empty() && round + 1 >= range.rounds) break;
    const bool coarser = met != bytes;
    if (coarser ? coarseness >= range.most : coarseness <= range.least) break;
    const double log_ratio = std::log(std::max(ratio, 1e-6));
    bracket.tell(std::log(coarseness), log_ratio);
    if (bracket.narrow()) break;
    coarseness = std::clamp(std::exp(bracket.next(std::log(coarseness), log_ratio)), range.least, range.most);
  }
  if (best.empty()) cannot_meet(target);
  return best;
}

}  // namespace kinespace
