// A clip of a million frames: linear time, memory in proportion to the file.
#include <ctime>
#include <string>

#include <gtest/gtest.h>

#include "motion/amc.h"
#include "motion/bvh.h"
#include "tests/motion/allocation_meter.h"
#include "tests/motion/sample_clips.h"

namespace kinespace::test {
namespace {

// Of this thread alone: the machine may be busy.
double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::string long_bvh(int frames) {
  std::string text =
      "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
      "JOINT b\n{\nOFFSET 0 10 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n}\n}\nMOTION\nFrames: " +
      std::to_string(frames) + "\nFrame Time: 0.008333\n";
  for (int f = 0; f < frames; ++f) {
    const std::string whole = std::to_string(f % 1000);
    text.append(whole)
        .append(".25 91.5 0 ")
        .append(whole)
        .append(".125 -2.5 30.0625 10 ")
        .append(whole)
        .append(" -7\n");
  }
  return text;
}

std::string long_amc(int frames) {
  std::string text = ":FULLY-SPECIFIED\n:DEGREES\n";
  for (int f = 0; f < frames; ++f) {
    const std::string whole = std::to_string(f % 1000);
    text.append(std::to_string(f + 1)).append("\nroot 0 ").append(whole).append(".5 0 10 -20.25 ").append(whole);
    text.append("\nfemur 5 -6 7.5\ntibia ").append(whole).append("\n");
  }
  return text;
}

template <typename Parse>
double fastest_of_three(const Parse& parse) {
  double best = 1e9;
  for (int i = 0; i < 3; ++i) {
    const double start = cpu_seconds();
    parse();
    best = std::min(best, cpu_seconds() - start);
  }
  return best;
}

TEST(LongClip, a_bvh_of_a_million_frames_takes_linear_time_and_memory_in_proportion) {
  const std::string half = long_bvh(500'000);
  const std::string whole = long_bvh(1'000'000);
  const AllocationMeter meter;
  const Clip clip = parse_bvh(whole, "long.bvh");
  EXPECT_LT(meter.peak_bytes(), 4 * whole.size());
  EXPECT_EQ(clip.frames, 1'000'000);
  EXPECT_EQ(clip.rate_hz, 120);
  EXPECT_EQ(clip.translation(0, 999'999).x(), 999.25);
  const double half_time = fastest_of_three([&] { static_cast<void>(parse_bvh(half, "half.bvh")); });
  const double whole_time = fastest_of_three([&] { static_cast<void>(parse_bvh(whole, "long.bvh")); });
  EXPECT_LT(whole_time, 3 * half_time);
}

TEST(LongClip, an_amc_of_a_million_frames_takes_linear_time_and_memory_in_proportion) {
  const Asf asf = parse_asf(small_asf, "t.asf");
  const std::string half = long_amc(500'000);
  const std::string whole = long_amc(1'000'000);
  const AllocationMeter meter;
  const Clip clip = parse_amc(whole, asf, "long.amc");
  EXPECT_LT(meter.peak_bytes(), 4 * whole.size());
  EXPECT_EQ(clip.frames, 1'000'000);
  const double half_time = fastest_of_three([&] { static_cast<void>(parse_amc(half, asf, "half.amc")); });
  const double whole_time = fastest_of_three([&] { static_cast<void>(parse_amc(whole, asf, "long.amc")); });
  EXPECT_LT(whole_time, 3 * half_time);
}

TEST(LongClip, a_constant_joint_costs_no_track) {
  std::string text =
      "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
      "JOINT b\n{\nOFFSET 0 10 0\nCHANNELS 3 Xposition Yposition Zposition\n}\n}\nMOTION\nFrames: 1000\nFrame Time: "
      "1\n";
  for (int f = 0; f < 1000; ++f) text += (f < 999 ? "0 0 0" : "0 0 1") + std::string(" 10 4 -7\n");
  const Clip clip = parse_bvh(text, "t.bvh");
  ASSERT_EQ(clip.translations.size(), 1u);
  EXPECT_EQ(clip.translations[0].joint, 0);
  EXPECT_EQ(clip.translation(0, 998).z(), 0);
  EXPECT_EQ(clip.translation(0, 999).z(), 1);
  EXPECT_EQ(clip.skeleton.joints[1].offset, Eigen::Vector3d(10, 4, -7));
}

}  // namespace
}  // namespace kinespace::test
