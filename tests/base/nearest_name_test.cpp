#include "kinespace/base/nearest_name.h"

#include <vector>

#include <gtest/gtest.h>

namespace kinespace {
namespace {

TEST(NearestName, edits_are_counted) {
  EXPECT_EQ(edit_distance("", ""), 0U);
  EXPECT_EQ(edit_distance("build", "build"), 0U);
  EXPECT_EQ(edit_distance("biuld", "build"), 2U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(edit_distance("", "abc"), 3U);
}

TEST(NearestName, is_the_one_with_the_fewest_edits) {
  const std::vector<std::string> names{"blend", "build", "bench"};
  EXPECT_EQ(nearest_name("biuld", names), "build");
  EXPECT_EQ(nearest_name("bend", names), "blend");
  EXPECT_EQ(nearest_name("x", {}), std::nullopt);
}

TEST(NearestName, names_as_long_as_files_cost_no_more_than_others) {
  const std::string longest(10'000'000, 'a');
  EXPECT_EQ(edit_distance(longest, longest), 0U);
  EXPECT_EQ(edit_distance(longest, "a"), 255U);
}

}  // namespace
}  // namespace kinespace
