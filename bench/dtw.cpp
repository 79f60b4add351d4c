// `kinespace bench dtw`: batched time warping on the device against a plain loop in double on one thread.
#include "kinespace/kernels/dtw.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "bench/report.h"
#include "bench/timing.h"
#include "kinespace/base/error.h"
#include "kinespace/fpca/pose_features.h"
#include "kinespace/kernels/calibration.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kClips = 200;
constexpr std::size_t kReferenceStep = 100;  // the plain loop does one pair of so many
constexpr int kRounds = 3;

// Evenly spread over the folder, so that all its contents are among them.
std::vector<fs::path> chosen_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (is_motion_file(entry.path())) files.push_back(entry.path());
  }
  if (files.size() < kClips) {
    throw Error(ErrorKind::bad_input, {.file = folder.string(),
                                       .found = std::to_string(files.size()) + " motion files",
                                       .expected = std::to_string(kClips) + " clips of bandai2",
                                       .remedy = "name the folder with bandai2/ by --data"});
  }
  std::sort(files.begin(), files.end());
  std::vector<fs::path> chosen;
  for (std::size_t c = 0; c < kClips; ++c) chosen.push_back(files[c * files.size() / kClips]);
  return chosen;
}

FeatureSet clip_features(const fs::path& folder) {
  FeatureSet set;
  for (const auto& file : chosen_files(folder)) {
    const PoseFeatures features = pose_features(read_clip(file));
    set.dims = features.dims;
    set.add(features.values);
  }
  return set;
}

double cells(const FeatureSet& set, const std::vector<ClipPair>& pairs) {
  double sum = 0;
  for (const auto& pair : pairs) sum += static_cast<double>(set.rows(pair.query)) * set.rows(pair.target);
  return sum;
}

struct Case {
  std::string name;
  DtwOptions options;
  std::optional<double> bar;  // on the speed-up
};

class CaseRunner {
 public:
  CaseRunner(const FeatureSet& set, const Compute& compute)
      : set_(set), compute_(compute), pairs_(all_pairs(set.clips())) {
    for (std::size_t p = 0; p < pairs_.size(); p += kReferenceStep) reference_pairs_.push_back(pairs_[p]);
  }

  // The two are run in turn, and the fastest round of each counts: another process slows both.
  void run(const Case& one, BenchReport& report) const {
    double device = std::numeric_limits<double>::infinity();
    double plain = std::numeric_limits<double>::infinity();
    std::vector<DtwMatch> found;
    std::vector<DtwMatch> expected;
    for (int round = 0; round < kRounds; ++round) {
      plain = std::min(plain, seconds([&] { expected = reference::dtw(set_, set_, reference_pairs_, one.options); }));
      device = std::min(device, seconds([&] { found = dtw(set_, set_, pairs_, one.options, compute_); }));
    }
    const double device_rate = cells(set_, pairs_) / device * 1e-6;
    const double plain_rate = cells(set_, reference_pairs_) / plain * 1e-6;
    const auto add = [&](const std::string& what, double value, const char* unit, std::optional<double> bar,
                         bool higher) {
      report.results.push_back({.name = one.name + ": " + what,
                                .data = data(),
                                .value = value,
                                .unit = unit,
                                .bar = bar,
                                .higher_is_better = higher});
    };
    add("plain double loop, one thread", plain_rate, "Mcell/s", {}, true);
    add("device", device_rate, "Mcell/s", {}, true);
    add("device over plain loop", device_rate / plain_rate, "x", one.bar, true);
    add("largest relative difference of costs", difference(found, expected), "", 1e-5, false);
  }

 private:
  [[nodiscard]] std::string data() const {
    return "bandai2, all pairs of " + std::to_string(set_.clips()) + " clips, " + std::to_string(set_.dims) +
           " features";
  }
  static double difference(const std::vector<DtwMatch>& found, const std::vector<DtwMatch>& expected) {
    double worst = 0;
    for (std::size_t p = 0; p < expected.size(); ++p) {
      const auto& match = found[p * kReferenceStep];
      if (match.found() != expected[p].found()) return std::numeric_limits<double>::infinity();
      if (match.found()) worst = std::max(worst, std::abs(match.cost - expected[p].cost) / expected[p].cost);
    }
    return worst;
  }

  const FeatureSet& set_;
  const Compute& compute_;
  std::vector<ClipPair> pairs_;
  std::vector<ClipPair> reference_pairs_;
};

}  // namespace

BenchReport bench_dtw(const BenchOptions& options) {
  const auto compute = open_calibrated(options.device);
  const FeatureSet set = clip_features(options.data / "bandai2");
  BenchReport report{
      .bench = "dtw", .device = {}, .threads = static_cast<int>(std::thread::hardware_concurrency()), .results = {}};
  const CaseRunner runner(set, compute);
  const Case cases[] = {
      {"cost only", {}, 15},
      {"with path", {.want_path = true}, 5},
      {"slope limits, path", {.steps = StepPattern::slope_limited, .want_path = true}, {}},
      {"band of 10 %, cost only", {.band_fraction = 0.1}, {}},
  };
  for (const auto& one : cases) runner.run(one, report);
  report.device = compute.describe();
  report.kernels = compute.uses();
  return report;
}

}  // namespace kinespace
