// Clips and devices for the tests of warping.
#pragma once

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "kinespace/kernels/dtw.h"

namespace kinespace::test {

inline FeatureSet random_clips(const std::vector<int>& lengths, int dims, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  FeatureSet set{.dims = dims};
  for (const int length : lengths) {
    std::vector<float> rows(static_cast<std::size_t>(length) * dims);
    for (float& value : rows) value = normal(random);
    set.add(rows);
  }
  return set;
}

// The processor and, where there is a device, both OpenCL shapes.
inline std::vector<std::pair<std::string, Compute>> every_way() {
  std::vector<std::pair<std::string, Compute>> ways{{"cpu", Compute::open("cpu")}};
  if (!list_devices().empty()) {
    const auto device = Compute::open("opencl");
    ways.emplace_back("lanes", device.with_variant(KernelVariant::lanes));
    ways.emplace_back("groups", device.with_variant(KernelVariant::groups));
  }
  return ways;
}

}  // namespace kinespace::test
