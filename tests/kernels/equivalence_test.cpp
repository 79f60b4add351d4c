// Every kernel against its plain reference, over the sizes of its descriptor, on the processor and in both OpenCL
// shapes.
#include <cctype>

#include <gtest/gtest.h>

#include "kinespace/kernels/kernel_descriptor.h"
#include "tests/support/opencl_device.h"

namespace kinespace {
namespace {

std::string sizes_text(const KernelDescriptor& kernel, const KernelDescriptor::Sizes& sizes) {
  std::string text = kernel.name;
  for (std::size_t s = 0; s < sizes.size(); ++s) text += ", " + kernel.size_names[s] + " " + std::to_string(sizes[s]);
  return text;
}

double tolerance_on(const KernelDescriptor& kernel, const Compute& compute) {
  const auto* device = compute.device_for(kernel.family, 1);
  return device != nullptr && !compute.uses_double(*device) && kernel.single_tolerance > 0 ? kernel.single_tolerance
                                                                                           : kernel.tolerance;
}

void expect_equivalent(const KernelDescriptor& kernel, const Compute& compute) {
  ASSERT_FALSE(kernel.test_sizes.empty());
  const double tolerance = tolerance_on(kernel, compute);
  for (const auto& sizes : kernel.test_sizes) {
    for (const std::uint32_t seed : {1U, 2U}) {
      EXPECT_LE(kernel.compare(sizes, compute, seed).error, tolerance) << sizes_text(kernel, sizes);
    }
  }
}

class equivalence : public testing::TestWithParam<KernelDescriptor> {};

TEST_P(equivalence, processor_agrees_with_reference) {
  expect_equivalent(GetParam(), Compute::open("cpu"));
}

TEST_P(equivalence, opencl_lanes_agree_with_reference) {
  KINESPACE_REQUIRE_OPENCL();
  expect_equivalent(GetParam(), Compute::open("opencl").with_variant(KernelVariant::lanes));
}

TEST_P(equivalence, opencl_groups_agree_with_reference) {
  KINESPACE_REQUIRE_OPENCL();
  expect_equivalent(GetParam(), Compute::open("opencl").with_variant(KernelVariant::groups));
}

TEST(kernels, agree_with_reference_on_a_device_without_double) {
  KINESPACE_REQUIRE_OPENCL();
  int tested = 0;
  for (const auto& kernel : kernel_descriptors()) {
    if (kernel.single_tolerance == 0) continue;  // computes in float anyway
    ++tested;
    expect_equivalent(kernel, Compute::open("opencl").with_variant(KernelVariant::groups).without_double());
  }
  EXPECT_GT(tested, 0);
}

std::string test_name(const testing::TestParamInfo<KernelDescriptor>& kernel) {
  std::string name = kernel.param.name;
  for (char& letter : name) letter = std::isalnum(static_cast<unsigned char>(letter)) != 0 ? letter : '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(kernels, equivalence, testing::ValuesIn(kernel_descriptors()), test_name);

}  // namespace
}  // namespace kinespace
