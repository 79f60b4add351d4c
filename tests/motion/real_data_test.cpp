// Every file of the shared data, there and back.
#include <atomic>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "kinespace/motion/amc.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"
#include "tests/motion/sample_clips.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

std::vector<std::filesystem::path> motion_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> out;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (is_motion_file(entry.path())) out.push_back(entry.path());
  }
  std::ranges::sort(out);
  return out;
}

Clip through_bvh(const Clip& clip) {
  return parse_bvh(format_bvh(clip), "again.bvh");
}

Clip real_through_acclaim(const Clip& clip) {
  const AcclaimText text = format_amc(clip);
  return parse_amc(text.amc, parse_asf(text.asf, "again.asf"), "again.amc");
}

// What a file loses on its ways, the largest distance of any joint at any frame in cm.
struct Loss {
  double bvh = 0;
  double acclaim = 0;
};

TEST(RealData, every_file_goes_to_bvh_and_acclaim_and_back_within_1e_4_cm) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  std::vector<std::filesystem::path> files;
  for (const char* part : {"bandai1", "bandai2", "cmu"}) {
    const auto more = motion_files(data / part);
    files.insert(files.end(), more.begin(), more.end());
  }
  ASSERT_GE(files.size(), 1170u);
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  Loss largest;
  std::size_t done = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < files.size(); i = next++) {
      const Clip clip = read_clip(files[i]);
      const Clip again = through_bvh(clip);
      const Loss loss{largest_distance(clip, again), largest_distance_by_name(clip, real_through_acclaim(clip))};
      const std::lock_guard lock(mutex);
      EXPECT_TRUE(again.skeleton.same_tree(clip.skeleton)) << files[i];
      EXPECT_EQ(again.rate_hz, clip.rate_hz) << files[i];
      EXPECT_LE(loss.bvh, 1e-4) << files[i];
      EXPECT_LE(loss.acclaim, 1e-4) << files[i];
      largest = {std::max(largest.bvh, loss.bvh), std::max(largest.acclaim, loss.acclaim)};
      ++done;
    }
  };
  {
    const std::jthread other(work);
    work();
  }
  EXPECT_EQ(done, files.size());
  RecordProperty("largest_bvh_cm", std::to_string(largest.bvh));
  RecordProperty("largest_acclaim_cm", std::to_string(largest.acclaim));
}

TEST(RealData, the_data_is_what_its_readme_says) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const Clip cmu = read_clip(data / "cmu/02/02_01.amc");
  EXPECT_EQ(cmu.rate_hz, 120);
  EXPECT_EQ(cmu.skeleton.joint_count(), 31);
  const Clip bandai = read_clip(data / "bandai1/walk_normal_002.bvh");
  EXPECT_EQ(bandai.rate_hz, 30);
  EXPECT_EQ(bandai.skeleton.joint_count(), 22);
  EXPECT_NE(bandai.translation_track(0), nullptr) << "its root moves";
  EXPECT_EQ(read_clip(data / "bandai1/bow_active_001.bvh").translation_track(0), nullptr) << "its root rests";
  for (const char* subject : {"01/01_01", "03/03_01"}) {
    EXPECT_TRUE(read_clip(data / "cmu" / (std::string(subject) + ".amc")).skeleton.same_tree(cmu.skeleton)) << subject;
  }
}

TEST(RealData, feet_stand_on_the_floor_when_units_are_right) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  for (const char* name : {"cmu/02/02_01.amc", "bandai1/walk_normal_002.bvh"}) {
    const Clip clip = read_clip(data / name);
    const JointPositions positions = joint_positions(clip);
    double low = 1e9, high = -1e9;
    for (int j = 1; j < positions.joints; ++j) {
      low = std::min(low, positions.at(0, j).y());
      high = std::max(high, positions.at(0, j).y());
    }
    EXPECT_NEAR(low, 2, 8) << name;
    EXPECT_NEAR(high, 155, 25) << name;
  }
}

}  // namespace
}  // namespace kinespace::test
