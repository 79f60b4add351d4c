#include "kinespace/kernels/device.h"

#include <cstdlib>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/kernels/dtw.h"
#include "tests/support/opencl_device.h"

namespace kinespace {
namespace {

ErrorKind kind_of_failure(const std::string& choice) {
  try {
    static_cast<void>(Compute::open(choice));
  } catch (const Error& error) {
    return error.kind();
  }
  ADD_FAILURE() << choice << " was opened";
  return ErrorKind::bad_input;
}

FeatureSet two_clips() {
  FeatureSet set{.dims = 1};
  set.add(std::vector<float>{0, 1, 2, 3});
  set.add(std::vector<float>{0, 2, 3});
  return set;
}

TEST(device, bad_choice_is_a_usage_error) {
  for (const auto* choice : {"", "gpu", "opencl:", "opencl:x", "opencl:-1", "opencl:1 ", "OpenCL"}) {
    EXPECT_EQ(kind_of_failure(choice), ErrorKind::usage) << choice;
  }
}

TEST(device, missing_device_is_a_machine_error) {
  EXPECT_EQ(kind_of_failure("opencl:999"), ErrorKind::machine);
}

TEST(device, list_says_why_it_is_empty) {
  const auto list = list_opencl_devices();
  EXPECT_NE(list.devices.empty(), list.reason.empty());
}

TEST(device, describes_every_device) {
  KINESPACE_REQUIRE_OPENCL();
  for (const auto& device : list_devices()) {
    EXPECT_FALSE(device.name.empty());
    EXPECT_FALSE(device.platform.empty());
    EXPECT_FALSE(device.driver_version.empty());
    EXPECT_GT(device.compute_units, 0);
    EXPECT_GT(device.memory_bytes, 0U);
  }
}

TEST(device, named_device_says_what_computes) {
  KINESPACE_REQUIRE_OPENCL();
  const auto name = list_devices().front().name;
  EXPECT_NE(Compute::open("opencl:0").describe().find(name), std::string::npos);
  EXPECT_EQ(Compute::open("cpu").describe().find(name), std::string::npos);
}

TEST(device, auto_opens_nothing_for_small_calls) {
  const auto compute = Compute::open("auto");
  const auto clips = two_clips();
  static_cast<void>(dtw(clips, clips, all_pairs(2), {}, compute));
  EXPECT_NE(compute.describe().find("OpenCL not needed so far"), std::string::npos);
}

TEST(device, auto_uses_opencl_for_large_warping) {
  KINESPACE_REQUIRE_OPENCL();
  const auto compute = Compute::open("auto");
  EXPECT_EQ(compute.device_for(KernelFamily::dtw, 1e6), nullptr);
  EXPECT_NE(compute.device_for(KernelFamily::dtw, 1e12), nullptr);
  EXPECT_EQ(Compute::open("cpu").device_for(KernelFamily::dtw, 1e12), nullptr);
}

TEST(device, copies_share_their_state) {
  KINESPACE_REQUIRE_OPENCL();
  const auto compute = Compute::open("opencl");
  const std::vector<Compute> copies(2, compute);
  EXPECT_EQ(compute.device_for(KernelFamily::dtw, 1), copies.back().device_for(KernelFamily::dtw, 1));
}

// Run by ctest with no driver in sight (OCL_ICD_VENDORS).
class without_opencl : public testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("KINESPACE_TEST_NO_OPENCL") == nullptr) GTEST_SKIP() << "runs as kernels_without_opencl";
  }
};

TEST_F(without_opencl, list_is_empty_and_says_what_to_install) {
  const auto list = list_opencl_devices();
  EXPECT_TRUE(list.devices.empty());
  EXPECT_NE(list.reason.find("install pocl-opencl-icd"), std::string::npos) << list.reason;
}

TEST_F(without_opencl, named_device_is_a_machine_error) {
  EXPECT_EQ(kind_of_failure("opencl"), ErrorKind::machine);
  EXPECT_EQ(kind_of_failure("opencl:0"), ErrorKind::machine);
}

TEST_F(without_opencl, auto_computes_on_the_processor_and_says_why) {
  const auto compute = Compute::open("auto");
  EXPECT_EQ(compute.device_for(KernelFamily::dtw, 1e15), nullptr);
  EXPECT_NE(compute.describe().find("no OpenCL platform"), std::string::npos) << compute.describe();
  const auto clips = two_clips();
  EXPECT_DOUBLE_EQ(dtw(clips, clips, all_pairs(2), {}, compute).front().cost, 1);
}

}  // namespace
}  // namespace kinespace
