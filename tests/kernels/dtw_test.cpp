#include "kinespace/kernels/dtw.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "kinespace/base/error.h"
#include "tests/kernels/dtw_support.h"
#include "tests/support/opencl_device.h"

namespace kinespace {
namespace {

using test::every_way;
using test::random_clips;

// The cheapest path by trying every one; a straight step only after a diagonal one where slopes are limited.
double brute_force(const FeatureSet& set, int i, int j, bool slopes, bool may_go_straight = true) {
  const auto a = set.clip(0);
  const auto b = set.clip(1);
  double sum = 0;
  for (int k = 0; k < set.dims; ++k) {
    const double difference = a[i * set.dims + k] - b[j * set.dims + k];
    sum += difference * difference;
  }
  const double here = std::sqrt(sum);
  if (i == 0 && j == 0) return here;
  double best = HUGE_VAL;
  if (i > 0 && j > 0) best = std::min(best, brute_force(set, i - 1, j - 1, slopes, true));
  if (!slopes || may_go_straight) {  // seen from the end: the step before a straight one must be diagonal
    if (i > 0) best = std::min(best, brute_force(set, i - 1, j, slopes, false));
    if (j > 0) best = std::min(best, brute_force(set, i, j - 1, slopes, false));
  }
  return here + best;
}

TEST(dtw, equals_trying_every_path) {
  for (const auto& [name, compute] : every_way()) {
    for (int n = 1; n <= 6; ++n) {
      for (int m = 1; m <= 6; ++m) {
        const auto set = random_clips({n, m}, 3, static_cast<std::uint32_t>(10 * n + m));
        for (const bool slopes : {false, true}) {
          const DtwOptions options{.steps = slopes ? StepPattern::slope_limited : StepPattern::symmetric};
          const auto match = dtw(set, set, all_pairs(2), options, compute).front();
          const double expected = brute_force(set, n - 1, m - 1, slopes);
          if (std::isinf(expected)) {
            EXPECT_FALSE(match.found()) << name << " " << n << " x " << m;
          } else {
            EXPECT_NEAR(match.cost, expected, 1e-5 * expected)
                << name << " " << n << " x " << m << " slopes " << slopes;
            EXPECT_DOUBLE_EQ(match.normalised, match.cost / (n + m));
          }
        }
      }
    }
  }
}

TEST(dtw, identical_clips_cost_nothing_and_match_frame_by_frame) {
  for (const auto& [name, compute] : every_way()) {
    const auto set = random_clips({70, 3}, 21, 5);
    for (const auto steps : {StepPattern::symmetric, StepPattern::slope_limited}) {
      const DtwOptions options{.steps = steps, .want_path = true};
      const std::vector<ClipPair> pairs{{0, 0}, {1, 1}};
      for (const auto& match : dtw(set, set, pairs, options, compute)) {
        EXPECT_EQ(match.cost, 0) << name;
        for (std::size_t s = 0; s < match.path.size(); ++s) {
          EXPECT_EQ(match.path[s], (FramePair{static_cast<int>(s), static_cast<int>(s)})) << name;
        }
      }
    }
  }
}

TEST(dtw, exchanging_the_clips_exchanges_the_path) {
  const auto set = random_clips({40, 33}, 4, 6);
  const std::vector<ClipPair> forth{{0, 1}};
  const std::vector<ClipPair> back{{1, 0}};
  for (const auto& [name, compute] : every_way()) {
    for (const double band : {0.0, 0.1}) {
      const DtwOptions options{.band_fraction = band, .want_path = true};
      const auto there = dtw(set, set, forth, options, compute).front();
      auto turned = dtw(set, set, back, options, compute).front();
      EXPECT_NEAR(there.cost, turned.cost, 1e-5 * there.cost) << name;
      for (auto& cell : turned.path) std::swap(cell.query, cell.target);
      EXPECT_EQ(there.path, turned.path) << name;
    }
  }
}

TEST(dtw, slope_limits_forbid_clips_of_over_twice_the_length) {
  const auto set = random_clips({10, 20, 21, 5, 4}, 2, 7);
  const DtwOptions options{.steps = StepPattern::slope_limited, .want_path = true};
  const std::vector<ClipPair> pairs{{0, 1}, {0, 2}, {0, 3}, {0, 4}};
  for (const auto& [name, compute] : every_way()) {
    const auto matches = dtw(set, set, pairs, options, compute);
    EXPECT_TRUE(matches[0].found()) << name;
    EXPECT_FALSE(matches[1].found()) << name;
    EXPECT_TRUE(matches[1].path.empty()) << name;
    EXPECT_TRUE(matches[2].found()) << name;
    EXPECT_FALSE(matches[3].found()) << name;
  }
}

TEST(dtw, empty_clips_have_no_path) {
  const auto set = random_clips({0, 5, 0}, 2, 8);
  for (const auto& [name, compute] : every_way()) {
    for (const auto& match : dtw(set, set, all_pairs(3), {.want_path = true}, compute)) {
      EXPECT_FALSE(match.found()) << name;
    }
  }
}

TEST(dtw, a_pair_costs_the_same_whatever_is_asked_with_it) {
  const auto set = random_clips({40, 7, 33, 90, 12, 64, 65, 1, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26}, 9, 9);
  const auto pairs = all_pairs(set.clips());
  for (const auto& [name, compute] : every_way()) {
    const auto together = dtw(set, set, pairs, {.want_path = true}, compute);
    for (std::size_t p = 0; p < pairs.size(); p += 7) {
      const auto alone = dtw(set, set, std::span(pairs).subspan(p, 1), {.want_path = true}, compute).front();
      EXPECT_EQ(alone.cost, together[p].cost) << name;
      EXPECT_EQ(alone.path, together[p].path) << name;
    }
  }
}

TEST(dtw, many_clips_against_one_template_equal_the_template_against_many_clips) {
  const auto set = random_clips({50, 31, 45, 52, 60, 77, 48, 41, 39, 80}, 6, 10);
  std::vector<ClipPair> to_template;
  std::vector<ClipPair> from_template;
  for (int c = 1; c < set.clips(); ++c) {
    to_template.push_back({c, 0});
    from_template.push_back({0, c});
  }
  for (const auto& [name, compute] : every_way()) {
    const auto there = dtw(set, set, to_template, {.want_path = true}, compute);
    const auto back = dtw(set, set, from_template, {.want_path = true}, compute);
    for (std::size_t p = 0; p < there.size(); ++p) {
      EXPECT_NEAR(there[p].cost, back[p].cost, 1e-5 * there[p].cost) << name;
      EXPECT_EQ(there[p].path.size(), back[p].path.size()) << name;
    }
  }
}

TEST(dtw, does_not_depend_on_threads) {
  const auto set = random_clips({40, 7, 33, 90, 12, 64, 65, 1, 17}, 9, 11);
  const auto pairs = all_pairs(set.clips());
  const auto several = dtw(set, set, pairs, {});
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const auto single = dtw(set, set, pairs, {});
  for (std::size_t p = 0; p < pairs.size(); ++p) EXPECT_EQ(several[p].cost, single[p].cost);
}

// Large calls under "auto" go to the device, but not pairs that would leave most of its lanes empty.
TEST(dtw, auto_takes_the_device_where_pairs_share_clips) {
  KINESPACE_REQUIRE_OPENCL();
  if (list_devices().front().type != "cpu") {
    if (test::data_required()) FAIL() << "the first OpenCL device is no processor: install PoCL alone";
    GTEST_SKIP() << "the first OpenCL device is no processor";
  }
  const auto set = random_clips(std::vector<int>(16, 500), 1000, 15);
  std::vector<ClipPair> apart;
  std::vector<ClipPair> shared;
  for (int c = 0; c < 16; c += 2) {
    apart.push_back({c, c + 1});
    shared.push_back({1, c});
  }
  const DtwOptions narrow{.band_fraction = 0.01};  // quick, but counted as whole tables
  const auto costs = [&](const std::vector<ClipPair>& pairs, const char* choice) {
    std::vector<double> out;
    for (const auto& match : dtw(set, set, pairs, narrow, Compute::open(choice))) out.push_back(match.cost);
    return out;
  };
  EXPECT_EQ(costs(apart, "auto"), costs(apart, "cpu"));
  EXPECT_EQ(costs(shared, "auto"), costs(shared, "opencl"));
  EXPECT_NE(costs(shared, "auto"), costs(shared, "cpu"));  // float against double
}

TEST(dtw, pairs_that_exceed_the_memory_for_paths_take_turns) {
  // 33 jobs of 700 x 700 cells need about 60 MB of back-pointers on a device; the limit is 1 MiB.
  const auto set = random_clips(std::vector<int>(34, 700), 1, 12);
  std::vector<ClipPair> pairs;
  for (int c = 1; c < set.clips(); ++c) pairs.push_back({0, c});
  for (const auto& [name, compute] : every_way()) {
    if (name == "groups") pairs.resize(4);
    const auto scarce = dtw(set, set, pairs, {.want_path = true, .path_memory_bytes = 1U << 20}, compute);
    for (std::size_t p = 0; p < pairs.size(); p += 11) {
      const auto ample = reference::dtw(set, set, std::span(pairs).subspan(p, 1), {.want_path = true}).front();
      EXPECT_NEAR(scarce[p].cost, ample.cost, 1e-5 * ample.cost) << name;
      EXPECT_EQ(scarce[p].path.back(), (FramePair{699, 699})) << name;
    }
  }
}

TEST(dtw, two_sets_match_like_one) {
  const auto both = random_clips({30, 20, 25, 44}, 5, 13);
  FeatureSet first{.dims = 5};
  FeatureSet second{.dims = 5};
  for (const int c : {0, 1}) first.add(both.clip(c));
  for (const int c : {2, 3}) second.add(both.clip(c));
  const std::vector<ClipPair> pairs{{0, 2}, {0, 3}, {1, 2}, {1, 3}};
  for (const auto& [name, compute] : every_way()) {
    const auto one = dtw(both, both, pairs, {}, compute);
    const auto two = dtw(first, second, all_pairs(2, 2), {}, compute);
    for (std::size_t p = 0; p < pairs.size(); ++p) EXPECT_EQ(one[p].cost, two[p].cost) << name;
  }
}

template <typename Call>
void expect_error(ErrorKind kind, const std::string& part, const Call& call) {
  try {
    call();
    ADD_FAILURE() << "no error: " << part;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind);
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(dtw, says_what_is_wrong_with_its_input) {
  const auto set = random_clips({4, 5}, 2, 14);
  const auto match = [&](const FeatureSet& a, const FeatureSet& b, std::vector<ClipPair> pairs, DtwOptions options) {
    static_cast<void>(dtw(a, b, pairs, options));
  };
  expect_error(ErrorKind::usage, "query 2", [&] { match(set, set, {{2, 0}}, {}); });
  expect_error(ErrorKind::usage, "target -1", [&] { match(set, set, {{0, -1}}, {}); });
  expect_error(ErrorKind::usage, "band_fraction", [&] { match(set, set, {}, {.band_fraction = NAN}); });
  expect_error(ErrorKind::usage, "features", [&] { match(set, random_clips({4}, 3, 1), {{0, 0}}, {}); });
  auto broken = set;
  broken.values[2 * 5 + 1] = NAN;
  expect_error(ErrorKind::bad_input, "feature 1 of row 1 of query 1", [&] { match(broken, set, {{1, 0}}, {}); });
  expect_error(ErrorKind::usage, "values", [&] {
    broken.values.pop_back();
    match(broken, set, {}, {});
  });
}

}  // namespace
}  // namespace kinespace
