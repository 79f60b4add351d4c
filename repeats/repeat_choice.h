// The greedy choice of primary clips and their repetitions among similar-posture paths (lin2011 section 4.2.2).
//
//   PriCost(s, e) = stdev(Dist(m, f), f = s .. e) * (e - s + 1) + Dist(m, s) + overhead       (2), m the middle frame
//   RepCost(s, e) = stdev(Dist(Ref(f), f), f = s .. e) * (e - s + 1) + overhead               (3)
//   Gain          = (PriCost + sum_i PriCost(i)) / (PriCost + sum_i RepCost(i))               (5)
//
// Frames are counted at the rate of the clips, distances are the table's; the deviation is taken over at most 24
// frames, evenly spread. The ends of the paths, projected to the time axis, are cuts; what lies between cuts not nearer
// than `shortest_s`, and between cuts further apart up to `longest_s`, are candidates. The candidate of the largest
// gain becomes primary, all stretches that paths lead to from it and that no clip holds yet become its repetitions;
// what remains of other candidates competes on. Gains up to `least_gain` end the choice.
#pragma once

#include <span>
#include <vector>

#include "kinespace/repeats/posture_paths.h"
#include "kinespace/repeats/self_distance.h"

namespace kinespace {

struct ChoiceOptions {
  double shortest_s = 0.2;           // 0.02 to 10: no clip is shorter but where the motion is
  double longest_s = 4;              // shortest_s to 600: of a primary clip
  double least_gain = 1.05;          // >= 1
  double primary_overhead_s = 0.1;   // 0 to 60: the constants of the paper's equations 2
  double repeated_overhead_s = 0.1;  // 0 to 60: and 3, as so many seconds of a deviation of the typical distance
  void validate() const;             // throws Error{usage} naming field, value and range
};

// Equation 2 for pixels [first, last) of one run.
[[nodiscard]] double primary_cost(const SelfDistance& table, int first, int last, const ChoiceOptions& options = {});

// Equation 3 for the distances of a repeated clip's pixels to those they refer to.
[[nodiscard]] double repeated_cost(const SelfDistance& table, std::span<const float> distances,
                                   const ChoiceOptions& options = {});

// A repeated stretch: pixels [first, last) of one run, and the pixel, between two pixels where need be, of the primary
// clip that each refers to: never falling.
struct Repetition {
  int first = 0;
  int last = 0;
  std::vector<float> reference;
};

struct PrimaryChoice {
  int first = 0;
  int last = 0;
  double gain = 0;  // when it was chosen
  std::vector<Repetition> repetitions;
};

// In the order chosen. No pixel is in two of the intervals.
[[nodiscard]] std::vector<PrimaryChoice> choose_repeats(const SelfDistance& table, std::span<const PosturePath> paths,
                                                        const ChoiceOptions& options = {});

}  // namespace kinespace
