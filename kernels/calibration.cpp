#include "kinespace/kernels/calibration.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <thread>

#include "kinespace/base/error.h"
#include "kinespace/kernels/kernel_descriptor.h"

namespace kinespace {
namespace {

constexpr int kCalibrationRounds = 3;
constexpr double kWorthIt = 1.1;  // the rates of one machine differ by as much from hour to hour

int processor_threads() {
  return static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

struct Line {
  double overhead_s = 0;
  double rate = 0;
  double startup_s = 0;  // what the very first call took longer
};

// The line through the best times of a small and a large call.
Line measure_line(const KernelDescriptor& kernel, const Compute& compute) {
  const auto& small = kernel.calibration_sizes.front();
  const auto& large = kernel.calibration_sizes.back();
  const std::vector<double> of_small = kernel.seconds(small, compute, kCalibrationRounds + 1);
  const std::vector<double> of_large = kernel.seconds(large, compute, kCalibrationRounds);
  const double least_small = *std::min_element(of_small.begin() + 1, of_small.end());
  const double least_large = *std::min_element(of_large.begin(), of_large.end());
  const double more = kernel.flops(large) - kernel.flops(small);
  Line line{.startup_s = std::max(0.0, of_small.front() - least_small)};
  // A clock too coarse, or a busy machine: then the large call alone.
  line.rate = least_large > least_small ? more / (least_large - least_small)
                                        : kernel.flops(large) / std::max(least_large, 1e-9);
  line.overhead_s = std::max(0.0, least_small - kernel.flops(small) / line.rate);
  return line;
}

}  // namespace

double KernelSpeed::from_flops() const {
  if (!(device_rate >= kWorthIt * processor_rate)) return std::numeric_limits<double>::infinity();
  const double later = device_overhead_s + startup_s - processor_overhead_s;
  return std::max(0.0, later / (1 / processor_rate - 1 / device_rate));
}

double DeviceCalibration::from_flops(KernelFamily family) const {
  const auto found = std::ranges::find(kernels, family, &KernelSpeed::family);
  return found == kernels.end() ? std::numeric_limits<double>::infinity() : found->from_flops();
}

DeviceCalibration calibrate(const std::string& choice, const Progress& progress) {
  // The driver's own compiler first: it keeps what it made, so that a later process does not wait for it.
  const Compute compiling = Compute::open(choice);
  const auto start = std::chrono::steady_clock::now();
  const Compute device = Compute::open(choice);
  const double opening_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::optional<DeviceInfo> info = device.device_info();
  if (!info) {
    throw Error(ErrorKind::usage, {.found = "device '" + choice + "'", .expected = "opencl or opencl:N to measure"});
  }
  DeviceCalibration out{.device = info->name,
                        .platform = info->platform,
                        .driver_version = info->driver_version,
                        .threads = processor_threads(),
                        .kernels = {}};
  const Compute processor;
  const auto kernels = kernel_descriptors();
  const auto measured = [](const KernelDescriptor& kernel) { return !kernel.calibration_sizes.empty(); };
  const auto count = static_cast<double>(std::ranges::count_if(kernels, measured));
  for (const KernelDescriptor& kernel : kernels) {
    if (!measured(kernel)) continue;
    progress.check_stop();
    progress.at("calibrate", static_cast<double>(out.kernels.size()) / count);
    static_cast<void>(kernel.seconds(kernel.calibration_sizes.front(), compiling, 1));
    const Line here = measure_line(kernel, processor);
    const Line there = measure_line(kernel, device);
    out.kernels.push_back({.family = kernel.family,
                           .processor_rate = here.rate,
                           .processor_overhead_s = here.overhead_s,
                           .device_rate = there.rate,
                           .device_overhead_s = there.overhead_s,
                           .startup_s = opening_s + there.startup_s});
  }
  progress.at("calibrate", 1);
  return out;
}

const DeviceCalibration* find_calibration(const std::vector<DeviceCalibration>& known, const DeviceInfo& device) {
  const auto found = std::ranges::find_if(known, [&](const DeviceCalibration& one) {
    return one.device == device.name && one.platform == device.platform &&
           one.driver_version == device.driver_version && one.threads == processor_threads();
  });
  return found == known.end() ? nullptr : &*found;
}

Compute open_calibrated(const std::string& choice) {
  return choice == "auto" ? Compute::open(choice, read_calibrations().devices) : Compute::open(choice);
}

}  // namespace kinespace
