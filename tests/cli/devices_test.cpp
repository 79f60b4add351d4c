// Which kernels run where, as a user sees it: --device, what "auto" goes by, and what the JSON says of it.
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/cli/sample_clips.h"
#include "tests/support/opencl_device.h"

namespace kinespace::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

json printed_by(const std::vector<std::string>& arguments, const CommandOptions& options = {}) {
  const CommandResult result = run_command(arguments, options);
  EXPECT_EQ(result.code, 0) << result.err;
  return json::parse(result.out, nullptr, false);
}

// Over all stages, by family.
std::map<std::string, long> summed(const json& printed, const char* key) {
  std::map<std::string, long> out;
  for (const json& stage : printed.at("stages")) {
    for (const json& kernel : stage.at("kernels")) out[kernel.at("kernel")] += kernel.at(key).get<long>();
  }
  return out;
}

class Devices : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    write_sample_clips(*folder_ / "clips");
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string path(const char* name) { return (*folder_ / name).string(); }
  static json build(const char* library, const std::string& device) {
    return printed_by({"build", path("clips"), "-o", path(library), "--smooth", "--device", device, "--json"});
  }
  static json query(const char* library, const std::string& device, const CommandOptions& options = {}) {
    return printed_by(
        {"query", path(library), "walk_normal_001", "-k", "3", "--candidates", "4", "--device", device, "--json"},
        options);
  }

  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<TemporaryFolder> Devices::folder_;

TEST_F(Devices, opencl_runs_every_kernel_of_build_and_query_and_finds_the_same) {
  KINESPACE_REQUIRE_OPENCL();
  const json built = build("there.kspace", "opencl");
  const json here = build("here.kspace", "cpu");
  const json asked = query("there.kspace", "opencl");
  std::map<std::string, long> launches = summed(built, "launches");
  for (const auto& [kernel, count] : summed(asked, "launches")) launches[kernel] += count;
  for (const KernelFamily family : kernel_families)
    EXPECT_GT(launches[std::string(name_of(family))], 0) << name_of(family);
  for (const json& printed : {built, asked}) {
    for (const auto& [kernel, calls] : summed(printed, "processor_calls")) EXPECT_EQ(calls, 0) << kernel;
  }
  for (const auto& [kernel, count] : summed(here, "launches")) EXPECT_EQ(count, 0) << kernel;
  EXPECT_NE(built.at("device"), here.at("device"));

  EXPECT_EQ(built.at("sequences"), here.at("sequences"));
  EXPECT_EQ(built.at("functions"), here.at("functions"));
  EXPECT_NEAR(built.at("variance").get<double>(), here.at("variance").get<double>(), 1e-5);
  // Expected scores of a smoothed space depend on its small eigenvalues, which a device has in float.
  EXPECT_NEAR(built.at("mean_joint_error_cm").get<double>(), here.at("mean_joint_error_cm").get<double>(), 3e-3);
  const json same = query("here.kspace", "cpu");
  ASSERT_EQ(asked.at("matches").size(), same.at("matches").size());
  for (std::size_t i = 0; i < same.at("matches").size(); ++i) {
    EXPECT_EQ(asked.at("matches")[i].at("clip"), same.at("matches")[i].at("clip"));
    EXPECT_NEAR(asked.at("matches")[i].at("distance").get<double>(), same.at("matches")[i].at("distance").get<double>(),
                1e-3);
  }
}

// Retrieval's bench matches all pairs of clips: of the sample motions here.
TEST_F(Devices, a_bench_says_what_ran_where) {
  KINESPACE_REQUIRE_OPENCL();
  std::filesystem::create_directories(*folder_ / "data");
  std::filesystem::create_directory_symlink(path("clips"), *folder_ / "data/bandai2");
  const json printed = printed_by({"bench", "retrieval", "--data", path("data"), "--device", "opencl", "--json"});
  std::map<std::string, long> launches;
  for (const json& kernel : printed.at("kernels")) launches[kernel.at("kernel")] = kernel.at("launches");
  EXPECT_EQ(launches.size(), kernel_families.size());
  for (const char* kernel : {"covariance", "projection", "dtw"}) EXPECT_GT(launches[kernel], 0) << kernel;
}

TEST_F(Devices, build_query_and_encode_tell_their_stages) {
  const auto names = [](const json& printed) {
    std::vector<std::string> out;
    for (const json& stage : printed.at("stages")) {
      EXPECT_GE(stage.at("seconds"), 0);
      EXPECT_TRUE(stage.at("kernels").is_array());
      out.push_back(stage.at("stage"));
    }
    return out;
  };
  const json built = build("stages.kspace", "cpu");
  EXPECT_THAT(names(built), testing::IsSupersetOf({"import", "survey", "analyse", "index", "encode", "store"}));
  EXPECT_GT(summed(built, "processor_calls")["covariance"], 0);
  EXPECT_GT(summed(built, "processor_calls")["local_linear"], 0);
  const json asked = query("stages.kspace", "cpu");
  EXPECT_THAT(names(asked), testing::ElementsAre("read", "search", "warp"));
  EXPECT_GT(summed(asked, "processor_calls")["dtw"], 0);
  const json encoded = printed_by({"encode", path("clips/walk_normal_001.bvh"), "-o", path("walk.ksm"), "--json"});
  EXPECT_THAT(names(encoded), testing::IsSupersetOf({"reading", "encode", "write"}));
  EXPECT_THAT(encoded.at("device").get<std::string>(), HasSubstr("cpu"));
  EXPECT_THAT(run_command({"query", path("stages.kspace"), "walk_normal_001", "-v"}).err, HasSubstr("warp: "));
}

// What is kept is what --device auto goes by: the file that was measured says in turn that the device always pays and
// that it never does.
TEST_F(Devices, auto_goes_by_what_was_measured_here) {
  KINESPACE_REQUIRE_OPENCL();
  static_cast<void>(build("measured.kspace", "cpu"));
  const std::string cache = path("cache");
  const CommandOptions with_cache{.environment = {"XDG_CACHE_HOME=" + cache}};
  const json measured = printed_by({"devices", "--calibrate", "--json"}, with_cache);
  const std::filesystem::path file = std::filesystem::path(cache) / "kinespace" / "devices.json";
  ASSERT_TRUE(std::filesystem::exists(file));
  EXPECT_EQ(printed_by({"devices", "--json"}, with_cache), measured) << "it is read again, not measured";
  for (std::size_t i = 1; i < measured.at("devices").size(); ++i) {
    const json& kernels = measured.at("devices")[i].at("calibration");
    ASSERT_EQ(kernels.size(), kernel_families.size());
    for (const json& kernel : kernels) EXPECT_GT(kernel.at("device_gflops"), 0) << kernel;
  }
  for (const bool pays : {true, false}) {
    json kept = json::parse(read_text(file));
    for (json& device : kept.at("devices")) {
      for (json& kernel : device.at("kernels")) {
        kernel["device_flops_per_s"] = pays ? 1e15 : 1.0;
        kernel["device_overhead_s"] = kernel["startup_s"] = 0.0;
      }
    }
    write_text(file, kept.dump());
    const json asked = query("measured.kspace", "auto", with_cache);
    EXPECT_EQ(summed(asked, "launches")["dtw"] > 0, pays);
    EXPECT_EQ(summed(asked, "processor_calls")["dtw"] > 0, !pays);
  }

  write_text(file, "no calibration");
  const CommandResult ignoring =
      run_command({"query", path("measured.kspace"), "walk_normal_001", "--json"}, with_cache);
  EXPECT_EQ(ignoring.code, 0);
  EXPECT_THAT(ignoring.err, HasSubstr("devices --calibrate"));
  EXPECT_EQ(run_command({"devices", "--calibrate", "--quiet"}, with_cache).err, "");
  EXPECT_EQ(run_command({"query", path("measured.kspace"), "walk_normal_001"}, with_cache).err, "");
}

TEST_F(Devices, a_build_of_many_clips_measures_first_and_once) {
  KINESPACE_REQUIRE_OPENCL();
  std::filesystem::create_directory(*folder_ / "many");
  constexpr int many = 1001;
  for (int i = 0; i < many; ++i) {
    write_text(*folder_ / "many" / ("clip_" + std::to_string(i) + ".bvh").c_str(), walking_bvh(5, 1 + 0.001 * i));
  }
  const CommandOptions with_cache{.environment = {"XDG_CACHE_HOME=" + path("cache of many")}};
  const std::vector<std::string> build{"build", path("many"), "-o", path("many.kspace"), "--json"};
  const CommandResult first = run_command(build, with_cache);
  EXPECT_EQ(first.code, 0) << first.err;
  EXPECT_THAT(first.err, HasSubstr("measuring once"));
  EXPECT_TRUE(std::filesystem::exists(*folder_ / "cache of many/kinespace/devices.json"));
  EXPECT_THAT(run_command(build, with_cache).err, testing::Not(HasSubstr("measuring")));
}

}  // namespace
}  // namespace kinespace::test
