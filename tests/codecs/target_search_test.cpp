// The search for a target, on responses that are known: how often it asks, and that what it gives meets the target.
#include "kinespace/codecs/stream/target_search.h"

#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

struct Response {
  std::function<double(double)> error = [](double c) { return c; };
  std::function<double(double)> bytes = [](double c) { return 1000 + 1000 / c; };
};

struct Found {
  double error = 0;
  double bytes = 0;
  int attempts = 0;
};

// A stream is as long as the response says, and tells its error.
Found search(const Response& response, const CodecTarget& target, const SearchRange& range) {
  Found out;
  std::map<std::size_t, double> errors;
  const Bytes stream = search_target(target, range, [&](double c) {
    ++out.attempts;
    EXPECT_GE(c, range.least * 0.7);
    EXPECT_LE(c, range.most * 1.3);
    CodedAttempt made{.stream = Bytes(static_cast<std::size_t>(response.bytes(c))), .error = {}};
    made.error.mean_joint_error_cm = made.error.max_joint_error_cm = response.error(c);
    errors[made.stream.size()] = response.error(c);
    return made;
  });
  out.bytes = static_cast<double>(stream.size());
  out.error = errors.at(stream.size());
  return out;
}

const SearchRange wide{.start = 1, .least = 1e-5, .most = 1e3, .rounds = 12};

TEST(TargetSearch, meets_errors_closely_in_few_attempts_wherever_it_starts) {
  const Response response{.error = [](double c) { return 0.1 + 0.9 * std::pow(c, 1.3); }};
  for (const double start : {1e-3, 0.1, 1.0, 30.0}) {
    for (const double target : {0.15, 0.5, 4.0}) {
      SearchRange range = wide;
      range.start = start;
      const Found found = search(response, {.mean_error_cm = target}, range);
      EXPECT_LE(found.error, target);
      EXPECT_GE(found.error, 0.985 * target) << start;
      EXPECT_LE(found.attempts, 12) << start << " " << target;
    }
  }
}

TEST(TargetSearch, meets_sizes_of_which_most_is_fixed) {
  for (const auto& [fixed, moving, target] :
       {std::tuple{1500.0, 300.0, 1530}, {3000.0, 300.0, 3020}, {20000.0, 600.0, 20100}, {0.0, 5000.0, 40000}}) {
    const Response response{.bytes = [&, f = fixed, m = moving](double c) { return f + m / c; }};
    const Found found = search(response, {.bytes = target}, wide);
    EXPECT_LE(found.bytes, target);
    EXPECT_GE(found.bytes, 0.985 * target);
  }
}

TEST(TargetSearch, meets_errors_that_have_a_floor) {
  const Response response{.error = [](double c) { return 0.5 + 0.5 * c; }};
  const Found found = search(response, {.max_error_cm = 0.52}, wide);
  EXPECT_LE(found.error, 0.52);
}

TEST(TargetSearch, meets_errors_that_jump) {
  const Response response{.error = [](double c) { return c * (1 + 0.3 * std::sin(40 * c)); }};
  for (const double target : {0.2, 0.5, 1.1, 2.7}) {
    const Found found = search(response, {.max_error_cm = target}, wide);
    EXPECT_LE(found.error, target);
    EXPECT_GE(found.error, 0.6 * target);
  }
}

TEST(TargetSearch, what_cannot_be_met_is_said_after_so_many_attempts) {
  int attempts = 0;
  const auto attempt = [&](double c) {
    ++attempts;
    CodedAttempt made{.stream = Bytes(100), .error = {}};
    made.error.mean_joint_error_cm = 1 + c;
    return made;
  };
  try {
    static_cast<void>(search_target({.mean_error_cm = 0.5}, wide, attempt));
    ADD_FAILURE() << "half the least error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_NE(std::string(error.what()).find("0.5 cm"), std::string::npos);
  }
  EXPECT_LE(attempts, 2 * wide.rounds + 10);
  EXPECT_THROW(static_cast<void>(search_target({.bytes = 50}, wide, attempt)), Error);
}

TEST(TargetSearch, an_error_that_is_always_nothing_ends_at_the_coarsest) {
  const Response lossless{.error = [](double) { return 0.0; }, .bytes = [](double c) { return 500 + 10 / c; }};
  const Found found = search(lossless, {.mean_error_cm = 1}, wide);
  EXPECT_LE(found.attempts, wide.rounds + 1);
  EXPECT_LT(found.bytes, 510);
}

}  // namespace
}  // namespace kinespace
