// Every step is done once; a loop inside of one that failed does not pretend to be done.
#include "kinespace/base/parallel.h"

#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task.h>
#include <tbb/task_group.h>

namespace kinespace {
namespace {

TEST(ParallelFor, does_every_step_once) {
  std::vector<int> times(1000, 0);
  parallel_for(std::size_t{3}, times.size(), [&](std::size_t i) { ++times[i]; });
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_EQ(times[i], i < 3 ? 0 : 1) << i;
  parallel_for(5, 5, [](int) { FAIL() << "there is no step"; });
  parallel_for(5, 4, [](int) { FAIL() << "there is no step"; });
}

TEST(ParallelFor, throws_what_a_step_threw) {
  const auto third_fails = [](int i) {
    if (i == 3) throw std::runtime_error("third");
  };
  try {
    parallel_for(0, 10, third_fails);
    FAIL() << "nothing was thrown";
  } catch (const std::runtime_error& e) {
    EXPECT_EQ(e.what(), std::string("third"));
  }
}

// As it is for a step that still runs when another one has failed: none of its own loop's steps can be missing afterwards.
TEST(ParallelFor, inside_a_loop_that_has_failed_ends_the_step_that_called_it) {
  bool began = false;
  bool went_on = false;
  parallel_for(0, 1, [&](int) {
    began = tbb::task::current_context()->cancel_group_execution();
    parallel_for(0, 100, [](int) {});
    went_on = true;
  });
  EXPECT_TRUE(began);
  EXPECT_FALSE(went_on);
}

}  // namespace
}  // namespace kinespace
