// What a kernel is tested and timed by: one descriptor drives the equivalence test (kernel against plain reference) and
// the bench, so that a kernel cannot be in one and not in the other.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "kinespace/kernels/device.h"

namespace kinespace {

struct KernelDescriptor {
  using Sizes = std::vector<int>;  // in the order of `size_names`

  struct Comparison {
    double error = 0;  // largest |kernel - reference| over the largest |reference|; infinity where only one is finite
    double kernel_seconds = 0;
    double reference_seconds = 0;
  };

  std::string name;
  KernelFamily family = KernelFamily::dtw;
  std::vector<std::string> size_names;
  std::vector<Sizes> test_sizes;  // with 0, 1, the tiles' sizes and their neighbours, and odd ones
  Sizes bench_sizes;
  std::vector<Sizes> calibration_sizes;  // small, large; none where another kernel stands for the family
  double tolerance = 0;                  // on Comparison::error
  double single_tolerance = 0;           // the same on a device without double, where that differs
  std::function<double(const Sizes&)> flops;
  std::function<double(const Sizes&)> bytes;  // read and written, each number once
  // Makes data from the seed, computes both and compares.
  std::function<Comparison(const Sizes&, const Compute&, std::uint32_t seed)> compare;
  // Makes data and computes only the kernel, so many times; how long each took. Of kernels with calibration_sizes.
  std::function<std::vector<double>(const Sizes&, const Compute&, int rounds)> seconds;
};

// Every kernel.
[[nodiscard]] std::vector<KernelDescriptor> kernel_descriptors();

}  // namespace kinespace
