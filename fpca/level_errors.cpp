#include "kinespace/fpca/level_errors.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "kinespace/motion/joint_distance.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

// Of one level: of the clip, and the largest error in each of its sequences, in order.
struct MeasuredLevel {
  MeasuredError error;
  std::vector<double> worst;
};

// The clip as it was read, part by part as it is decoded. Of a clip that is not long the joints are found once for all
// levels.
class Original {
 public:
  Original(const ClipCurves& curves, const Skeleton& skeleton) : curves_(curves), skeleton_(skeleton) {}

  // Of the rows from a frame on, as they are in the original or as `values` has them.
  [[nodiscard]] JointPositions joints(int first, const Eigen::Ref<const SampleMatrix>& values) const {
    return joint_positions(clip_of_frames(curves_, values, first, skeleton_));
  }
  // Parts must come in the same order at every level.
  double add(std::size_t part, int first, const Eigen::Ref<const SampleMatrix>& rows, JointDistance& distance) {
    constexpr int most_kept_frames = 10'000;
    if (curves_.frames() > most_kept_frames) {
      return distance.add(joints(first, curves_.values.middleRows(first, rows.rows())), joints(first, rows));
    }
    if (part == kept_.size()) kept_.push_back(joints(first, curves_.values.middleRows(first, rows.rows())));
    return distance.add(kept_[part], joints(first, rows));
  }

 private:
  const ClipCurves& curves_;
  const Skeleton& skeleton_;
  std::vector<JointPositions> kept_;  // by part
};

MeasuredLevel measure_level(const ClipDecoder& decoder, Original& original, const EncodedClip& clip, int level) {
  MeasuredLevel out;
  JointDistance distance;
  decoder.decode_in_parts(clip, level, {}, [&](int first, const Eigen::Ref<const SampleMatrix>& rows) {
    out.worst.push_back(original.add(out.worst.size(), first, rows, distance));
  });
  out.error = {.mean_joint_error_cm = distance.mean(), .max_joint_error_cm = distance.largest()};
  return out;
}

using MeasuredLevels = std::map<int, MeasuredLevel>;

// Measures the levels [from, to] among those that are there.
void measure(const ClipDecoder& decoder, Original& original, const EncodedClip& clip, int from, int to,
             MeasuredLevels& levels) {
  for (auto& [level, measured] : levels) {
    if (level >= from && level <= to) measured = measure_level(decoder, original, clip, level);
  }
}

constexpr int finest_level_meant = 10;  // beyond it errors are those of the recording: noise, lost markers

// The least that takes a sequence within what each level is meant to leave; what no level reaches asks for nothing.
int extra_detail(const MeasuredLevels& measured, std::size_t sequence) {
  int out = 0;
  for (auto meant = measured.begin(); meant != measured.upper_bound(finest_level_meant); ++meant) {
    const double largest = largest_error_meant(meant->first);
    // From there on it is never left, though more functions are now and then worse in a single frame.
    auto enough = measured.end();
    while (enough != meant && std::prev(enough)->second.worst[sequence] <= largest) --enough;
    if (enough == measured.end()) continue;
    const int extra = (16 * (enough->first - meant->first) + meant->first - 1) / meant->first;
    out = std::max(out, std::min(extra, most_extra_detail));
  }
  return out;
}

bool give_detail(const MeasuredLevels& measured, EncodedClip& clip) {
  bool any = false;
  std::size_t number = 0;
  for (EncodedRun& run : clip.runs) {
    for (EncodedSequence& sequence : run.sequences) {
      sequence.extra_detail = extra_detail(measured, number++);
      any = any || sequence.extra_detail > 0;
    }
  }
  return any;
}

// Beside neighbours of fewer numbers a sequence may still err more than all at that level did: then it takes a few more.
bool raise_detail(const MeasuredLevels& measured, EncodedClip& clip) {
  constexpr int step = 4;
  bool any = false;
  std::size_t number = 0;
  for (EncodedRun& run : clip.runs) {
    for (EncodedSequence& sequence : run.sequences) {
      const bool too_far =
          std::any_of(measured.begin(), measured.upper_bound(finest_level_meant),
                      [&](const auto& level) { return level.second.worst[number] > largest_error_meant(level.first); });
      ++number;
      if (!too_far || sequence.extra_detail == 0 || sequence.extra_detail == most_extra_detail) continue;
      sequence.extra_detail = std::min(sequence.extra_detail + step, most_extra_detail);
      any = true;
    }
  }
  return any;
}

}  // namespace

double largest_error_meant(int level) {
  return 11.5 * std::pow(5.0 / level, 1.25);
}

std::vector<int> measured_levels(int levels) {
  std::vector<int> out;
  for (int level = 1; level < levels; level = level < 6 ? level + 1 : level + level / 4) out.push_back(level);
  if (levels > 0) out.push_back(levels);
  return out;
}

void measure_levels(const ClipDecoder& decoder, const ClipCurves& original, const Skeleton& skeleton, int levels,
                    EncodedClip& clip) {
  Original read(original, skeleton);
  MeasuredLevels measured;
  for (const int level : measured_levels(levels)) measured[level] = {};
  measure(decoder, read, clip, 1, levels, measured);
  constexpr int most_rounds = 4;
  const bool any = give_detail(measured, clip);
  bool changed = any;
  for (int round = 0; changed && round < most_rounds; ++round) {
    measure(decoder, read, clip, 1, finest_level_meant, measured);
    changed = round + 1 < most_rounds && raise_detail(measured, clip);
  }
  if (any) measure(decoder, read, clip, finest_level_meant + 1, levels, measured);
  clip.levels.clear();
  for (const auto& [level, of_level] : measured) clip.levels.push_back({level, of_level.error});
  clip.error = clip.levels.empty() ? measure_level(decoder, read, clip, -1).error : clip.levels.back().error;
}

}  // namespace kinespace
