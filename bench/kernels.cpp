// `kinespace bench kernels`: every kernel at its descriptor's size, on the processor and on the OpenCL device.
#include <algorithm>
#include <limits>
#include <string>
#include <thread>

#include "bench/report.h"
#include "kinespace/kernels/kernel_descriptor.h"

namespace kinespace {
namespace {

constexpr int kKernelRounds = 3;

std::string sizes_text(const KernelDescriptor& kernel) {
  std::string text;
  for (std::size_t s = 0; s < kernel.bench_sizes.size(); ++s) {
    text += (s == 0 ? "" : ", ") + std::to_string(kernel.bench_sizes[s]) + " " + kernel.size_names[s];
  }
  return text;
}

// The fastest of a few rounds: another process on the machine slows them.
void measure(const KernelDescriptor& kernel, const Compute& compute, const std::string& where, BenchReport& report) {
  double seconds = std::numeric_limits<double>::infinity();
  double error = 0;
  for (int round = 0; round < kKernelRounds; ++round) {
    const auto result = kernel.compare(kernel.bench_sizes, compute, 1);
    seconds = std::min(seconds, result.kernel_seconds);
    error = std::max(error, result.error);
  }
  const double operations = kernel.flops(kernel.bench_sizes);
  const std::string data = sizes_text(kernel);
  const double tolerance = std::max(kernel.tolerance, kernel.single_tolerance);
  report.results.push_back(
      {.name = kernel.name + ", " + where, .data = data, .value = operations / seconds * 1e-9, .unit = "GFLOP/s"});
  report.results.push_back({.name = kernel.name + ", " + where + ": memory rate",
                            .data = data,
                            .value = kernel.bytes(kernel.bench_sizes) / seconds * 1e-9,
                            .unit = "GB/s"});
  report.results.push_back(
      {.name = kernel.name + ", " + where + ": largest relative difference from the plain reference",
       .data = data,
       .value = error,
       .unit = "",
       .bar = tolerance});
}

}  // namespace

BenchReport bench_kernels(const BenchOptions& options) {
  const bool has_device = options.device != "cpu" && (options.device != "auto" || !list_devices().empty());
  const auto device = Compute::open(!has_device || options.device != "auto" ? options.device : "opencl");
  BenchReport report{.bench = "kernels",
                     .device = device.describe(),
                     .threads = static_cast<int>(std::thread::hardware_concurrency()),
                     .results = {}};
  for (const auto& kernel : kernel_descriptors()) {
    measure(kernel, Compute(), "processor", report);
    if (has_device) measure(kernel, device, "OpenCL", report);
  }
  report.kernels = device.uses();
  return report;
}

}  // namespace kinespace
