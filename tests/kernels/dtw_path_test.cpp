// Paths: legal steps inside the band, and a sum of distances that equals the cost.
#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/kernels/dtw.h"
#include "tests/kernels/dtw_support.h"

namespace kinespace {
namespace {

using test::every_way;
using test::random_clips;

double distance(const FeatureSet& set, const ClipPair& pair, const FramePair& frames, bool squared) {
  const auto a = set.clip(pair.query).subspan(static_cast<std::size_t>(frames.query) * set.dims, set.dims);
  const auto b = set.clip(pair.target).subspan(static_cast<std::size_t>(frames.target) * set.dims, set.dims);
  double sum = 0;
  for (int k = 0; k < set.dims; ++k) sum += std::pow(static_cast<double>(a[k]) - b[k], 2);
  return squared ? sum : std::sqrt(sum);
}

void expect_legal(const std::vector<FramePair>& path, int n, int m, const DtwOptions& options) {
  ASSERT_FALSE(path.empty());
  EXPECT_EQ(path.front(), (FramePair{0, 0}));
  EXPECT_EQ(path.back(), (FramePair{n - 1, m - 1}));
  bool was_straight = false;
  for (std::size_t s = 1; s < path.size(); ++s) {
    const int up = path[s].query - path[s - 1].query;
    const int along = path[s].target - path[s - 1].target;
    EXPECT_TRUE(up >= 0 && up <= 1 && along >= 0 && along <= 1 && up + along > 0);
    const bool straight = up + along == 1;
    if (options.steps == StepPattern::slope_limited) {
      EXPECT_FALSE(straight && was_straight) << "two straight steps at " << s;
    }
    was_straight = straight;
    if (options.band_fraction > 0) {
      const double off =
          std::abs(static_cast<double>(path[s].query) * (m - 1) - static_cast<double>(path[s].target) * (n - 1));
      EXPECT_LE(off, std::max({options.band_fraction * (n - 1) * (m - 1), n - 1.0, m - 1.0}));
    }
  }
}

class dtw_path : public testing::TestWithParam<DtwOptions> {};

TEST_P(dtw_path, is_legal_and_sums_to_the_cost) {
  const auto options = GetParam();
  const auto set = random_clips({1, 2, 3, 4, 5, 7, 8, 15, 16, 17, 31, 63, 64, 65, 90, 91, 130, 33, 40}, 5, 3);
  const auto pairs = all_pairs(set.clips());
  for (const auto& [name, compute] : every_way()) {
    int found = 0;
    const auto matches = dtw(set, set, pairs, options, compute);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      if (!matches[p].found()) continue;
      ++found;
      expect_legal(matches[p].path, set.rows(pairs[p].query), set.rows(pairs[p].target), options);
      double sum = 0;
      for (const auto& frames : matches[p].path) sum += distance(set, pairs[p], frames, options.squared);
      EXPECT_NEAR(sum, matches[p].cost, 1e-5 * sum) << name << " " << pairs[p].query << " " << pairs[p].target;
    }
    EXPECT_GT(found, 30) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(
    every_pattern, dtw_path,
    testing::Values(DtwOptions{.want_path = true}, DtwOptions{.squared = true, .want_path = true},
                    DtwOptions{.band_fraction = 0.1, .want_path = true},
                    DtwOptions{.band_fraction = 0.001, .want_path = true},
                    DtwOptions{.steps = StepPattern::slope_limited, .want_path = true},
                    DtwOptions{.steps = StepPattern::slope_limited, .band_fraction = 0.1, .want_path = true}));

// Symmetric steps have a path inside every band: it never gets thinner than the diagonal.
TEST(dtw, thinnest_band_keeps_a_path) {
  const auto set = random_clips({1, 2, 3, 7, 50, 97, 200}, 2, 4);
  for (const auto& [name, compute] : every_way()) {
    for (const auto& match : dtw(set, set, all_pairs(set.clips()), {.band_fraction = 1e-9}, compute)) {
      EXPECT_TRUE(match.found()) << name;
    }
  }
}

}  // namespace
}  // namespace kinespace
