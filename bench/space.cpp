// How well the motion space holds real motion - joint error by level of detail, jumps at cuts, and what alignment is
// worth. Part of `kinespace bench fpca`.
#include "bench/space.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "bench/prepared_set.h"
#include "kinespace/base/parallel.h"
#include "kinespace/fpca/level_errors.h"
#include "kinespace/fpca/space_builder.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

// What one clip adds to the figures of a level of detail.
struct ClipFigures {
  double error_sum = 0;
  double error_count = 0;
  double worst = 0;
  int worst_frame = 0;
  double jump = 0;                 // largest change of a joint's error from one frame to the next, cm
  std::vector<float> cut_changes;  // change of joint velocity at cuts beyond that of the motion itself, cm/s
  std::vector<float> other_changes;
};

ClipFigures measure(const RegisteredSpace& space, const Clip& clip, const EncodedClip& encoded, int n) {
  const JointPositions original = joint_positions(clip);
  const JointPositions decoded = joint_positions(clip_from_curves(decode(space, encoded, n), clip.skeleton));
  ClipFigures out;
  for (std::size_t i = 0; i < original.values.size(); ++i) {
    const double e = (original.values[i] - decoded.values[i]).norm();
    out.error_sum += e;
    if (e > out.worst) {
      out.worst = e;
      out.worst_frame = static_cast<int>(i) / original.joints;
    }
  }
  out.error_count = static_cast<double>(original.values.size());
  std::vector<char> at_cut(static_cast<std::size_t>(clip.frames), 0);
  for (const EncodedRun& run : encoded.runs) {
    for (std::size_t i = 1; i < run.sequences.size(); ++i) at_cut[static_cast<std::size_t>(run.sequences[i].first)] = 1;
    // A break of the recording is neither a cut nor motion.
    at_cut[static_cast<std::size_t>(run.sequences.front().first)] = 2;
    at_cut[static_cast<std::size_t>(run.sequences.back().last)] = 2;
  }
  for (int f = 1; f < clip.frames; ++f) {
    for (int j = 0; j < decoded.joints; ++j) {
      const Eigen::Vector3d change =
          (decoded.at(f, j) - original.at(f, j)) - (decoded.at(f - 1, j) - original.at(f - 1, j));
      out.jump = std::max(out.jump, change.norm());
    }
  }
  for (int f = 1; f + 1 < clip.frames; ++f) {
    if (at_cut[static_cast<std::size_t>(f)] == 2) continue;
    for (int j = 0; j < decoded.joints; ++j) {
      const auto change_of = [&](const JointPositions& p) {
        return (p.at(f + 1, j) - 2 * p.at(f, j) + p.at(f - 1, j)).norm() * clip.rate_hz;
      };
      if (at_cut[static_cast<std::size_t>(f)] == 1) {
        out.cut_changes.push_back(static_cast<float>(change_of(decoded) - change_of(original)));
      } else {
        out.other_changes.push_back(static_cast<float>(change_of(decoded)));
      }
    }
  }
  return out;
}

struct Figures {
  double mean = 0;
  double worst = 0;
  std::string worst_place;  // clip and frame
  double jump = 0;
  double jump_ratio = 0;
};

Figures measure(const PreparedSet& data, const RegisteredSpace& space, const std::vector<EncodedClip>& encoded, int n) {
  std::vector<ClipFigures> parts(data.clips.size());
  parallel_for(std::size_t{0}, parts.size(),
               [&](std::size_t i) { parts[i] = measure(space, data.clips[i], encoded[i], n); });
  Figures out;
  double sum = 0;
  double count = 0;
  float largest = 0;
  std::vector<float> others;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const ClipFigures& part = parts[i];
    sum += part.error_sum;
    count += part.error_count;
    if (part.worst > out.worst) {
      out.worst = part.worst;
      out.worst_place = fmt::format("{}, frame {}", data.clips[i].name, part.worst_frame);
    }
    out.jump = std::max(out.jump, part.jump);
    for (const float c : part.cut_changes) largest = std::max(largest, c);
    others.insert(others.end(), part.other_changes.begin(), part.other_changes.end());
  }
  out.mean = sum / count;
  if (!others.empty()) {
    const auto rank = static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(others.size() - 1));
    std::ranges::nth_element(others, others.begin() + rank);
    out.jump_ratio = static_cast<double>(largest) / static_cast<double>(others[static_cast<std::size_t>(rank)]);
  }
  return out;
}

// As a library has them: with the detail that fast motion takes.
std::vector<EncodedClip> encode_with_detail(const PreparedSet& data, const BuiltSpace& built) {
  std::vector<EncodedClip> out = encode_all(data, built);
  const ClipDecoder decoder(built.space);
  parallel_for(std::size_t{0}, out.size(), [&](std::size_t i) {
    ClipCurves curves = data.prepared[i].curves;
    built.space.apply_references(curves.values);
    measure_levels(decoder, curves, data.prepared[i].skeleton, built.space.levels(), out[i]);
  });
  return out;
}

// Numbers a curve and second that a level of detail takes: ends once, and functions.
double numbers_a_second(const RegisteredSpace& space, const std::vector<EncodedClip>& encoded, int level) {
  double numbers = 0;
  double seconds = 0;
  for (const EncodedClip& clip : encoded) {
    seconds += clip.frames / clip.rate_hz;
    for (const EncodedRun& run : clip.runs) {
      for (const EncodedSequence& s : run.sequences) {
        const MotionSpace& set = space.of(s.cycles);
        Eigen::Index needed = s.scores.rows();  // behind them there are zeros, which are not kept
        while (needed > 0 && s.scores.row(needed - 1).isZero(0)) --needed;
        numbers += static_cast<double>(std::min<Eigen::Index>(set.rows_at(s.level(level)), needed));
        if (set.options().pinned) numbers -= 1;
      }
    }
  }
  return numbers / seconds;
}

struct Bars {
  double at_5;
  double at_10;
  double at_all;
};

void level_of_detail_rows(const PreparedSet& data, const Bars& bars, const Compute& compute, BenchReport& report) {
  SpaceBuildOptions options;
  const BuiltSpace built = build_space(source_of(data.prepared), options, compute);
  const std::vector<EncodedClip> encoded = encode_with_detail(data, built);
  const auto add = [&](const std::string& name, double value, const char* unit, std::optional<double> bar) {
    report.results.push_back({.name = name, .data = data.name, .value = value, .unit = unit, .bar = bar});
  };
  const Figures five = measure(data, built.space, encoded, 5);
  const Figures ten = measure(data, built.space, encoded, 10);
  const Figures all = measure(data, built.space, encoded, -1);
  add("mean joint error, 5 functions", five.mean, "cm", bars.at_5);
  add("mean joint error, 10 functions", ten.mean, "cm", bars.at_10);
  add(fmt::format("mean joint error, all {} levels", built.space.levels()), all.mean, "cm", bars.at_all);
  add("numbers a curve and second, 5 functions", numbers_a_second(built.space, encoded, 5), "", {});
  add("worst joint error, 5 functions (" + five.worst_place + ")", five.worst, "cm", 12);
  add("worst joint error, 10 functions (" + ten.worst_place + ")", ten.worst, "cm", 5);
  add("worst joint error, all functions (" + all.worst_place + ")", all.worst, "cm", 1.5);
  add("largest change of a joint's error in one frame, 5 functions", five.jump, "cm", {});
  add("jump at cuts, 5 functions", five.jump_ratio, "x p99.9 elsewhere", 1.0);
  add("jump at cuts, 10 functions", ten.jump_ratio, "x p99.9 elsewhere", {});
  add("jump at cuts, all functions", all.jump_ratio, "x p99.9 elsewhere", {});
}

// Mean joint error at so many numbers a second, between the two levels around it (its logarithm by theirs).
class ErrorCurve {
 public:
  ErrorCurve(const PreparedSet& data, const BuiltSpace& built)
      : data_(data), space_(built.space), encoded_(encode_with_detail(data, built)) {}
  [[nodiscard]] double at(double numbers) {
    int level = 1;
    while (level < space_.levels() && numbers_a_second(space_, encoded_, level + 1) <= numbers) ++level;
    const double low = numbers_a_second(space_, encoded_, level);
    const double high = numbers_a_second(space_, encoded_, level + 1);
    const double part = high > low ? (numbers - low) / (high - low) : 0;
    return std::exp((1 - part) * std::log(error(level)) + part * std::log(error(level + 1)));
  }

 private:
  [[nodiscard]] double error(int level) {
    const auto found = known_.find(level);
    if (found != known_.end()) return found->second;
    return known_[level] = measure(data_, space_, encoded_, level).mean;
  }
  const PreparedSet& data_;
  const RegisteredSpace& space_;
  std::vector<EncodedClip> encoded_;
  std::map<int, double> known_;
};

// Every clip in equal windows of about that length.
PreparedSet cut_windows(const PreparedSet& data, double length_s) {
  PreparedSet out = cut_again(data, {.most_cycles = 0});
  for (PreparedClip& clip : out.prepared) {
    for (Run& run : clip.runs) {
      const int first = run.cuts.front();
      const int frames = run.cuts.back() - first;
      const auto windows = std::max(1, static_cast<int>(std::lround(frames / clip.curves.rate_hz / length_s)));
      run = {{first}};
      for (int i = 1; i <= windows && frames > 0; ++i) {
        run.cuts.push_back(first + static_cast<int>(std::lround(static_cast<double>(i) * frames / windows)));
      }
    }
  }
  return out;
}

// How many numbers a curve of a sequence takes until so much of the curves' variance is left.
int numbers_needed(const MotionSpace& set, double left_share) {
  const FunctionGroup& group = set.groups().front();
  double left = group.left + group.eigenvalues.sum();
  int numbers = set.options().pinned ? 1 : 0;
  for (Eigen::Index k = 0; k < group.eigenvalues.size() && left > left_share * group.variance; ++k, ++numbers) {
    left -= group.eigenvalues(k);
  }
  return numbers;
}

struct MeanLength {
  double seconds = 0;
  int sequences = 0;
  [[nodiscard]] double mean() const { return sequences > 0 ? seconds / sequences : 0; }
};

MeanLength length_of(const PreparedSet& data, const BuiltSpace& built, int cycles) {
  MeanLength out;
  for (std::size_t clip_number = 0; clip_number < data.prepared.size(); ++clip_number) {
    const PreparedClip& clip = data.prepared[clip_number];
    for (const Run& run : built.runs_of(static_cast<int>(clip_number), clip.runs)) {
      for (int i = 0; i < run.sequence_count(); ++i) {
        if (run.cycles_of(i) != cycles) continue;
        out.seconds += (run.last_frame(i) - run.first_frame(i)) / clip.curves.rate_hz;
        ++out.sequences;
      }
    }
  }
  return out;
}

struct RegistrationBars {
  std::optional<double> functions_999;
  std::optional<double> functions_9999;
  double error = 1;
};

// What registration is worth: cut at cycles, against as many equal windows (build --no-align).
void registration_rows(const PreparedSet& data, const RegistrationBars& bars, const Compute& compute,
                       BenchReport& report) {
  const auto add = [&](const std::string& name, double value, const char* unit, std::optional<double> bar) {
    report.results.push_back({.name = name, .data = data.name, .value = value, .unit = unit, .bar = bar});
  };
  SpaceBuildOptions options;
  const BuiltSpace registered = build_space(source_of(data.prepared), options, compute);
  options.align = false;
  const PreparedSet windows = cut_again(data, {.equal_windows = true});
  const BuiltSpace plain = build_space(source_of(windows.prepared), options, compute);
  double cyclic = 0;
  double all = 0;
  for (int cycles = 0; cycles <= SequenceOptions{}.most_cycles; ++cycles) {
    const double seconds = length_of(data, registered, cycles).seconds;
    all += seconds;
    if (cycles > 0) cyclic += seconds;
  }
  add("share of motion in whole cycles", 100 * cyclic / all, "%", {});
  const int three = SequenceOptions{}.most_cycles;
  if (registered.space.has(three)) {
    const double length = length_of(data, registered, three).mean();
    const PreparedSet same_length = cut_windows(data, length);
    const BuiltSpace held_against = build_space(source_of(same_length.prepared), options, compute);
    add("mean length of three cycles", length, "s", {});
    for (const auto& [left, bar] : {std::pair(1e-3, bars.functions_999), std::pair(1e-4, bars.functions_9999)}) {
      const std::string precision = fmt::format("{:g} of the variance", 1 - left);
      const int ours = numbers_needed(registered.space.of(three), left);
      const int theirs = numbers_needed(held_against.space.plain(), left);
      add("functions for " + precision + ", three whole cycles", ours, "functions", {});
      add("functions for " + precision + ", equal windows of that length", theirs, "functions", {});
      add("functions for " + precision + ", cycles over windows", static_cast<double>(ours) / theirs, "x", bar);
    }
  }
  ErrorCurve ours(data, registered);
  ErrorCurve theirs(windows, plain);
  for (const double numbers : {3.0, 5.0, 8.0, 12.0, 20.0}) {
    add(fmt::format("mean joint error at {:g} functions a second, registered over equal windows", numbers),
        ours.at(numbers) / theirs.at(numbers), "x", bars.error);
  }
}

bool is_walk_or_run(const std::string& name) {
  return name.starts_with("walk") || name.starts_with("run");
}

PreparedSet walks_and_runs(const PreparedSet& all) {
  PreparedSet data{all.name + ", walks and runs", {}, {}};
  for (std::size_t i = 0; i < all.clips.size(); ++i) {
    if (!is_walk_or_run(all.clips[i].name)) continue;
    data.clips.push_back(all.clips[i]);
    data.prepared.push_back(all.prepared[i]);
  }
  return data;
}

}  // namespace

void space_rows(const BenchOptions& options, const Compute& compute, BenchReport& report) {
  const PreparedSet bandai = load_prepared_set("bandai1+bandai2", {options.data / "bandai1", options.data / "bandai2"});
  level_of_detail_rows(bandai, {1.0, 0.25, 0.06}, compute, report);
  registration_rows(walks_and_runs(bandai), {0.6, 0.8, 0.8}, compute, report);
  registration_rows(bandai, {}, compute, report);
  const PreparedSet cmu =
      load_prepared_set("cmu 01-03", {options.data / "cmu/01", options.data / "cmu/02", options.data / "cmu/03"});
  level_of_detail_rows(cmu, {0.75, 0.40, 0.10}, compute, report);
  registration_rows(cmu, {}, compute, report);
}

}  // namespace kinespace
