#include "kinespace/kernels/calibration.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <thread>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/kernels/dtw.h"
#include "kinespace/kernels/keyframe_distance.h"
#include "tests/support/data.h"
#include "tests/support/opencl_device.h"

namespace kinespace {
namespace {

constexpr KernelSpeed fast_device{.family = KernelFamily::dtw,
                                  .processor_rate = 1e9,
                                  .processor_overhead_s = 0.001,
                                  .device_rate = 4e9,
                                  .device_overhead_s = 0.002,
                                  .startup_s = 0.1};

// All families alike.
DeviceCalibration calibration_of(const DeviceInfo& device, const KernelSpeed& speed) {
  DeviceCalibration out{.device = device.name,
                        .platform = device.platform,
                        .driver_version = device.driver_version,
                        .threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency())),
                        .kernels = {}};
  for (const KernelFamily family : kernel_families) {
    out.kernels.push_back(speed);
    out.kernels.back().family = family;
  }
  return out;
}

const DeviceInfo some_device{.name = "card \"1\"", .platform = "platform", .driver_version = "1.2"};

TEST(calibration, the_device_pays_where_both_lines_cross) {
  const double from = fast_device.from_flops();
  const double here = fast_device.processor_overhead_s + from / fast_device.processor_rate;
  const double there = fast_device.device_overhead_s + fast_device.startup_s + from / fast_device.device_rate;
  EXPECT_NEAR(here, there, 1e-12);
  EXPECT_NEAR(from, 0.101 / 0.75e-9, 1);
}

TEST(calibration, a_device_that_is_not_clearly_faster_never_pays) {
  KernelSpeed slow = fast_device;
  slow.device_rate = 1.05e9;
  EXPECT_TRUE(std::isinf(slow.from_flops()));
  EXPECT_TRUE(std::isinf(DeviceCalibration{}.from_flops(KernelFamily::dtw))) << "nothing was measured";
}

TEST(calibration, comes_back_from_its_file_and_replaces_what_was_there) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "new" / "folder" / "devices.json";
  EXPECT_TRUE(read_calibrations(file).devices.empty());
  EXPECT_TRUE(read_calibrations(file).damage.empty()) << "no file is no damage";
  keep_calibration(calibration_of(some_device, fast_device), file);
  DeviceInfo newer = some_device;
  newer.driver_version = "1.3";
  KernelSpeed faster = fast_device;
  faster.device_rate = 7e9;
  keep_calibration(calibration_of(newer, faster), file);
  DeviceInfo other = some_device;
  other.name = "card 2";
  keep_calibration(calibration_of(other, fast_device), file);

  const auto known = read_calibrations(file);
  ASSERT_EQ(known.devices.size(), 2U);
  EXPECT_EQ(find_calibration(known.devices, some_device), nullptr) << "measured with another driver";
  const DeviceCalibration* found = find_calibration(known.devices, newer);
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->from_flops(KernelFamily::covariance), faster.from_flops());
  EXPECT_EQ(find_calibration(known.devices, other)->from_flops(KernelFamily::dtw), fast_device.from_flops());
}

TEST(calibration, counts_only_beside_the_processor_that_it_was_measured_beside) {
  std::vector<DeviceCalibration> known{calibration_of(some_device, fast_device)};
  EXPECT_NE(find_calibration(known, some_device), nullptr);
  ++known.front().threads;
  EXPECT_EQ(find_calibration(known, some_device), nullptr);
}

TEST(calibration, a_damaged_file_is_ignored_said_and_replaced) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "devices.json";
  keep_calibration(calibration_of(some_device, fast_device), file);
  const std::string whole(FileContent(file).text());
  std::vector<std::string> damaged{"", "nonsense", "[]", "{}", std::string(2U << 20, ' ')};
  for (std::size_t length = 1; length < whole.find_last_of('}'); length += 37)
    damaged.push_back(whole.substr(0, length));
  for (const auto& [from, to] : {std::pair{"\"version\": 1", "\"version\": 2"},
                                 {"\"dtw\"", "\"dwt\""},
                                 {"1000000000.0", "0"},
                                 {"0.001", "-1"},
                                 {"\"threads\"", "\"threats\""}}) {
    damaged.push_back(whole);
    ASSERT_NE(whole.find(from), std::string::npos) << from << " in " << whole;
    damaged.back().replace(whole.find(from), std::string(from).size(), to);
  }
  for (const std::string& text : damaged) {
    std::ofstream(file, std::ios::trunc | std::ios::binary) << text;
    const auto known = read_calibrations(file);
    EXPECT_TRUE(known.devices.empty()) << text.substr(0, 200);
    EXPECT_NE(known.damage.find(file.string()), std::string::npos) << text.substr(0, 200);
    keep_calibration(calibration_of(some_device, fast_device), file);
    EXPECT_EQ(read_calibrations(file).devices.size(), 1U);
  }
}

// An environment variable as it was, at the end of the scope.
class VariableKept {
 public:
  explicit VariableKept(const char* name) : name_(name) {
    if (const char* value = std::getenv(name)) before_ = value;
  }
  ~VariableKept() { before_ ? ::setenv(name_, before_->c_str(), 1) : ::unsetenv(name_); }
  VariableKept(const VariableKept&) = delete;
  VariableKept& operator=(const VariableKept&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

TEST(calibration, the_file_lies_in_the_users_cache) {
  const VariableKept cache("XDG_CACHE_HOME");
  const VariableKept home("HOME");
  const auto with = [](const char* cache_home, const char* home_folder) {
    ::setenv("XDG_CACHE_HOME", cache_home, 1);
    ::setenv("HOME", home_folder, 1);
    return calibration_file();
  };
  EXPECT_EQ(with("/c", "/h"), "/c/kinespace/devices.json");
  EXPECT_EQ(with("not/absolute", "/h"), "/h/.cache/kinespace/devices.json");
  EXPECT_EQ(with("", ""), "");
  EXPECT_THROW(keep_calibration({}), Error);
}

FeatureSet many_clips() {
  FeatureSet set{.dims = 8};
  for (int c = 0; c < 32; ++c) set.add(std::vector<float>(8 * 40, static_cast<float>(c)));
  return set;
}

TEST(calibration, auto_goes_by_it) {
  KINESPACE_REQUIRE_OPENCL();
  const auto device = Compute::open("opencl").device_info();
  ASSERT_TRUE(device.has_value());
  KernelSpeed always = fast_device;
  always.startup_s = always.device_overhead_s = 0;
  KernelSpeed never = fast_device;
  never.device_rate = 1;
  const auto clips = many_clips();
  for (const bool pays : {true, false}) {
    const auto compute = Compute::open("auto", {calibration_of(*device, pays ? always : never)});
    static_cast<void>(dtw(clips, clips, all_pairs(clips.clips()), {}, compute));
    const KernelUse use = compute.uses()[static_cast<std::size_t>(KernelFamily::dtw)];
    EXPECT_EQ(use.launches > 0, pays);
    EXPECT_EQ(use.processor_calls, pays ? 0U : 1U);
    EXPECT_EQ(compute.device_for(KernelFamily::covariance, 1e15) != nullptr, pays) << "whatever the usual rule says";
  }
}

TEST(calibration, measures_every_family_on_both_sides) {
  KINESPACE_REQUIRE_OPENCL();
  const DeviceCalibration found = calibrate("opencl");
  const Compute device = Compute::open("opencl");
  static_cast<void>(device.device_for(KernelFamily::dtw, 1e12));
  ASSERT_TRUE(device.device_info());
  EXPECT_EQ(found.device, device.device_info()->name);
  EXPECT_EQ(found.kernels.size(), kernel_families.size());
  for (const KernelFamily family : kernel_families) {
    const auto speed = std::ranges::find(found.kernels, family, &KernelSpeed::family);
    ASSERT_NE(speed, found.kernels.end()) << name_of(family);
    EXPECT_GT(speed->processor_rate, 0);
    EXPECT_GT(speed->device_rate, 0);
    EXPECT_GE(speed->from_flops(), 0);
  }
  EXPECT_THROW(static_cast<void>(calibrate("cpu")), Error);
}

TEST(uses, count_launches_on_the_device_and_calls_on_the_processor) {
  const RowMatrix<float> rows = RowMatrix<float>::Random(5, 3);
  constexpr auto family = static_cast<std::size_t>(KernelFamily::keyframe_distances);
  const Compute processor = Compute::open("cpu");
  const Compute copy = processor;
  static_cast<void>(keyframe_distances(rows, rows, DistanceKind::rooted, copy));
  EXPECT_EQ(processor.uses()[family].processor_calls, 1U) << "copies share it";
  EXPECT_EQ(processor.uses()[family].launches, 0U);
  KINESPACE_REQUIRE_OPENCL();
  const Compute device = Compute::open("opencl");
  const KernelUses before = device.uses();
  static_cast<void>(keyframe_distances(rows, rows, DistanceKind::rooted, device));
  const KernelUses added = since(before, device.uses());
  EXPECT_EQ(added[family].launches, 1U);
  EXPECT_EQ(added[family].processor_calls, 0U);
  EXPECT_EQ(added[static_cast<std::size_t>(KernelFamily::dtw)].launches, 0U);
}

}  // namespace
}  // namespace kinespace
