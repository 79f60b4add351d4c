// How well the motion space holds real motion - joint error by level of detail, jumps at cuts, and what alignment is
// worth. Part of `kinespace bench fpca`.
#include "bench/space.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/space_builder.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

struct DataSet {
  std::string name;
  std::vector<Clip> clips;
  std::vector<PreparedClip> prepared;
};

DataSet load_data_set(const std::string& name, const std::vector<std::filesystem::path>& folders) {
  std::vector<std::filesystem::path> files;
  for (const auto& folder : folders) {
    if (!std::filesystem::is_directory(folder)) {
      throw Error(ErrorKind::bad_input, {.file = folder.string(),
                                         .found = "no such folder",
                                         .expected = "the clips of this bench",
                                         .remedy = "name the folder that has them with --data"});
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (is_motion_file(entry.path())) files.push_back(entry.path());
    }
  }
  std::ranges::sort(files);
  DataSet out{name, std::vector<Clip>(files.size()), std::vector<PreparedClip>(files.size())};
  tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
    out.clips[i] = read_clip(files[i]);
    out.prepared[i] = prepare(out.clips[i]);
  });
  return out;
}

// What one clip adds to the figures of a level of detail.
struct ClipFigures {
  double error_sum = 0;
  double error_count = 0;
  double worst = 0;
  int worst_frame = 0;
  std::vector<float> cut_changes;  // change of joint speed at cuts, cm/s
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
  for (int f = 1; f + 1 < clip.frames; ++f) {
    if (at_cut[static_cast<std::size_t>(f)] == 2) continue;
    for (int j = 0; j < decoded.joints; ++j) {
      const double before = (decoded.at(f, j) - decoded.at(f - 1, j)).norm();
      const double after = (decoded.at(f + 1, j) - decoded.at(f, j)).norm();
      const auto change = static_cast<float>(std::abs(after - before) * clip.rate_hz);
      (at_cut[static_cast<std::size_t>(f)] == 1 ? out.cut_changes : out.other_changes).push_back(change);
    }
  }
  return out;
}

struct Figures {
  double mean = 0;
  double worst = 0;
  std::string worst_place;  // clip and frame
  double jump_ratio = 0;
};

Figures measure(const DataSet& data, const RegisteredSpace& space, const std::vector<EncodedClip>& encoded, int n) {
  std::vector<ClipFigures> parts(data.clips.size());
  tbb::parallel_for(std::size_t{0}, parts.size(),
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

std::vector<EncodedClip> encode_all(const DataSet& data, const BuiltSpace& built) {
  std::vector<EncodedClip> out(data.prepared.size());
  tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t i) {
    ClipCurves curves = data.prepared[i].curves;
    built.space.apply_references(curves.values);
    out[i] = encode(built.space, curves, data.prepared[i].runs, built.warps[i]);
  });
  return out;
}

// What is left of the curves' variance after n functions, n = 0, 1, ...
std::vector<double> residual_variance(const MotionSpace& space) {
  const FunctionGroup& group = space.groups().front();
  std::vector<double> out{group.variance};
  for (const double lambda : group.eigenvalues) out.push_back(out.back() - lambda);
  return out;
}

struct Bars {
  double at_5;
  double at_10;
  double at_all;
};

void level_of_detail_rows(const DataSet& data, const Bars& bars, const Compute& compute, BenchReport& report) {
  SpaceBuildOptions options;
  const BuiltSpace built = build_space(source_of(data.prepared), options, compute);
  const std::vector<EncodedClip> encoded = encode_all(data, built);
  const auto add = [&](const std::string& name, double value, const char* unit, std::optional<double> bar) {
    report.results.push_back({.name = name, .data = data.name, .value = value, .unit = unit, .bar = bar});
  };
  const Figures five = measure(data, built.space, encoded, 5);
  const Figures ten = measure(data, built.space, encoded, 10);
  const Figures all = measure(data, built.space, encoded, -1);
  add("mean joint error, 5 functions", five.mean, "cm", bars.at_5);
  add("mean joint error, 10 functions", ten.mean, "cm", bars.at_10);
  add(fmt::format("mean joint error, all {} functions", built.space.functions()), all.mean, "cm", bars.at_all);
  add("worst joint error, 5 functions (" + five.worst_place + ")", five.worst, "cm", {});
  add("worst joint error, 10 functions (" + ten.worst_place + ")", ten.worst, "cm", 15);
  add("jump at cuts, 5 functions", five.jump_ratio, "x p99.9 elsewhere", 1.0);
  add("jump at cuts, 10 functions", ten.jump_ratio, "x p99.9 elsewhere", {});
  add("jump at cuts, all functions", all.jump_ratio, "x p99.9 elsewhere", {});
}

bool is_walk_or_run(const std::string& name) {
  return name.starts_with("walk") || name.starts_with("run");
}

// Table 1 of the paper: the functions that a precision of 0.9999 takes, with and without alignment (for that
// precision).
void alignment_rows(const DataSet& all, const Compute& compute, BenchReport& report) {
  DataSet data{all.name + ", walks and runs", {}, {}};
  for (std::size_t i = 0; i < all.clips.size(); ++i) {
    if (!is_walk_or_run(all.clips[i].name)) continue;
    data.clips.push_back(all.clips[i]);
    data.prepared.push_back(all.prepared[i]);
  }
  SpaceBuildOptions options;
  options.space.functions = 40;
  options.align = false;
  const BuiltSpace plain = build_space(source_of(data.prepared), options, compute);
  const std::vector<double> before = residual_variance(plain.space);
  const auto needed = [](const std::vector<double>& left, double most) {
    return static_cast<int>(std::ranges::find_if(left, [most](double r) { return r <= most; }) - left.begin());
  };
  const auto add = [&](const std::string& name, double value, const char* unit, std::optional<double> bar) {
    report.results.push_back({.name = name, .data = data.name, .value = value, .unit = unit, .bar = bar});
  };
  const int without = needed(before, 1e-4 * before.front());
  add("functions for precision 0.9999, not aligned (paper: 10)", without, "functions", {});
  options.align = true;
  options.alignment.functions = std::max(1, without / 2);  // levels of detail n and 2n
  options.alignment.least_gain = 0.05;
  const BuiltSpace aligned = build_space(source_of(data.prepared), options, compute);
  const std::vector<double> after = residual_variance(aligned.space);
  add("functions for precision 0.9999, aligned (paper: 6)", needed(after, 1e-4 * after.front()), "functions",
      without - 1.0);
  for (const int n : {5, 10, without}) {
    const auto k = static_cast<std::size_t>(n);
    add(fmt::format("variance left by {} functions, aligned over not", n), after[k] / before[k], "x", {});
  }
  add("mean joint error at 10 functions, aligned over not",
      measure(data, aligned.space, encode_all(data, aligned), 10).mean /
          measure(data, plain.space, encode_all(data, plain), 10).mean,
      "x", {});
}

}  // namespace

void space_rows(const BenchOptions& options, const Compute& compute, BenchReport& report) {
  const DataSet bandai = load_data_set("bandai1+bandai2", {options.data / "bandai1", options.data / "bandai2"});
  level_of_detail_rows(bandai, {1.0, 0.25, 0.06}, compute, report);
  alignment_rows(bandai, compute, report);
  const DataSet cmu =
      load_data_set("cmu 01-03", {options.data / "cmu/01", options.data / "cmu/02", options.data / "cmu/03"});
  level_of_detail_rows(cmu, {0.75, 0.40, 0.10}, compute, report);
}

}  // namespace kinespace
