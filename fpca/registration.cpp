#include "kinespace/fpca/registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "kinespace/fpca/alignment.h"

namespace kinespace {
namespace {

constexpr std::array levels_compared{5, 12};

struct Cost {
  double left = 0;     // what is left out, weighted, times time
  double numbers = 0;  // a curve
};
using Costs = std::array<Cost, levels_compared.size()>;

// The stretch of a run between two cuts, as one sequence.
void add_sequence(const MotionSpace& set, const RunSampler& sampler, int first, int last,
                  const Eigen::RowVectorXd& weights, const Compute& compute, Costs& costs) {
  const SampleMatrix samples = sampler.sample(first, last, Warp(), set.points());
  const ScoreMatrix scores = set.scores(samples, compute);
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const SampleMatrix left = (samples - set.samples(scores, levels_compared[i])).array().rowwise() * weights.array();
    costs[i].left += (last - first) * left.squaredNorm() / static_cast<double>(left.rows());
    costs[i].numbers += set.rows_at(levels_compared[i]) - (set.options().pinned ? 1 : 0);
  }
}

bool rests_win(const Costs& cycles, const Costs& rests) {
  double log_ratio = 0;  // of D N^4, cycles over rests
  for (std::size_t i = 0; i < cycles.size(); ++i) {
    constexpr double nothing = 1e-12;  // both may be exact
    log_ratio += std::log((cycles[i].left + nothing) / (rests[i].left + nothing)) +
                 4 * std::log(cycles[i].numbers / rests[i].numbers);
  }
  return log_ratio > 0;
}

bool described(const RegisteredSpace& space, const Run& run, const Run::Alternative& stretch) {
  for (int i = stretch.sequence; i < stretch.sequence + stretch.count; ++i) {
    if (!space.has(run.cycles_of(i))) return false;
  }
  return true;
}

Run chosen_run(const Run& run, std::span<const char> at_rests) {
  Run out{{run.cuts.front()}};
  std::size_t stretch = 0;
  for (int i = 0; i < run.sequence_count() && run.cuts.size() > 1;) {
    const bool starts = stretch < run.at_rests.size() && run.at_rests[stretch].sequence == i;
    if (starts && at_rests[stretch] != 0) {
      const Run::Alternative& other = run.at_rests[stretch];
      out.cuts.insert(out.cuts.end(), other.cuts.begin() + 1, other.cuts.end());
      i += other.count;
    } else {
      out.cuts.push_back(run.last_frame(i));
      out.cycles.resize(out.cuts.size() - 2, 0);
      out.cycles.push_back(static_cast<std::uint8_t>(run.cycles_of(i)));
      ++i;
    }
    if (starts) ++stretch;
    // The rest of a stretch that stays as it is follows sequence by sequence.
  }
  out.cycles.resize(out.cuts.size() - 1, 0);
  return out;
}

}  // namespace

RestChoice choose_rests(const RegisteredSpace& space, const SampleMatrix& values, const std::vector<Run>& runs,
                        double rate_hz, const Compute& compute) {
  const Eigen::RowVectorXd weights = curve_weights(space.skeleton());
  RestChoice out;
  for (const Run& run : runs) {
    if (run.at_rests.empty()) continue;
    const RunSampler sampler(values, run, rate_hz);
    for (const Run::Alternative& stretch : run.at_rests) {
      if (!described(space, run, stretch)) {
        out.push_back(1);
        continue;
      }
      Costs cycles{};
      Costs rests{};
      for (int i = stretch.sequence; i < stretch.sequence + stretch.count; ++i) {
        add_sequence(space.of(run.cycles_of(i)), sampler, run.first_frame(i), run.last_frame(i), weights, compute,
                     cycles);
      }
      for (std::size_t i = 0; i + 1 < stretch.cuts.size(); ++i) {
        add_sequence(space.plain(), sampler, stretch.cuts[i], stretch.cuts[i + 1], weights, compute, rests);
      }
      out.push_back(rests_win(cycles, rests) ? 1 : 0);
    }
  }
  return out;
}

std::vector<Run> apply_choice(const std::vector<Run>& runs, const RestChoice& at_rests) {
  std::vector<Run> out;
  std::size_t next = 0;
  for (const Run& run : runs) {
    out.push_back(chosen_run(run, std::span(at_rests).subspan(next, run.at_rests.size())));
    next += run.at_rests.size();
  }
  return out;
}

std::vector<Run> both_ways(const std::vector<Run>& runs) {
  std::vector<Run> out = runs;
  for (const Run& run : runs) {
    for (const Run::Alternative& stretch : run.at_rests) out.push_back({stretch.cuts});
  }
  return out;
}

}  // namespace kinespace
