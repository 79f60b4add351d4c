#include "kinespace/codecs/rma/detail/target_search.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

// How coarse an attempt is against its target: 1 on it, above 1 too coarse.
double excess_of(const CodecTarget& target, const CodedAttempt& attempt) {
  if (target.bytes)
    return std::max(1e-9, static_cast<double>(*target.bytes)) / static_cast<double>(attempt.stream.size());
  const double error = target.mean_error_cm ? attempt.error.mean_joint_error_cm : attempt.error.max_joint_error_cm;
  return error / (target.mean_error_cm ? *target.mean_error_cm : *target.max_error_cm);
}

}  // namespace

Bytes search_target(const CodecTarget& target, const SearchRange& range,
                    const std::function<CodedAttempt(double)>& attempt) {
  Bytes best;
  double coarseness = range.start;
  double fine = 0;    // on the fine side of the target
  double coarse = 0;  // on the coarse side
  const bool bytes = target.bytes.has_value();
  for (int round = 0; round < 2 * range.rounds; ++round) {
    CodedAttempt made = attempt(coarseness);
    const double excess = excess_of(target, made);
    const bool met = bytes ? excess >= 1 : excess <= 1;
    const bool better = best.empty() || (bytes ? made.stream.size() > best.size() : made.stream.size() < best.size());
    const bool close = std::min(excess, 1 / std::max(excess, 1e-12)) >= range.close;
    if (met && better) best = std::move(made.stream);
    if (met && close) break;
    (excess <= 1 ? fine : coarse) = coarseness;
    if (!best.empty() && round + 1 >= range.rounds) break;
    const bool at_end = excess <= 1 ? coarseness >= range.most : coarseness <= range.least;
    if (at_end) break;
    // A hair on the side that meets the target.
    double next = coarseness * std::clamp((bytes ? 1.003 : 0.993) / std::max(excess, 1e-9), 0.2, 5.0);
    if (fine > 0 && coarse > 0) {
      const double low = std::min(fine, coarse), high = std::max(fine, coarse);
      if (high < 1.002 * low) {
        if (!best.empty()) break;
        next = bytes ? 1.1 * high : 0.9 * low;
        fine = coarse = 0;
      } else if (next <= low * 1.0005 || next >= high / 1.0005) {
        next = std::sqrt(low * high);
      }
    }
    coarseness = std::clamp(next, range.least, range.most);
  }
  if (best.empty()) cannot_meet(target);
  return best;
}

}  // namespace kinespace
