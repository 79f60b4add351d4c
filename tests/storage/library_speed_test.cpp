// What queries and listings may cost. The limits are several times what this takes on two cores, so that they hold on a
// busy machine, and far below what a wrong layout would take.
#include <algorithm>
#include <chrono>
#include <cstdlib>

#include <gtest/gtest.h>

#include "tests/storage/sample_library.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using Clock = std::chrono::steady_clock;

// The best of five, in milliseconds; sanitizers multiply the limit.
template <typename Act>
double milliseconds(Act act) {
  double best = 1e9;
  for (int i = 0; i < 5; ++i) {
    const auto start = Clock::now();
    act();
    best = std::min(best, std::chrono::duration<double, std::milli>(Clock::now() - start).count());
  }
  return best;
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__OPTIMIZE__)
constexpr double slow = 20;
#else
constexpr double slow = 1;
#endif

TEST(LibrarySpeed, ten_thousand_clips_are_listed_without_their_blobs_in_50_ms) {
  const test::TemporaryFolder folder;
  const auto path = folder / "a.kspace";
  {
    Library library = Library::create(path);
    test::fill_sample(library, 10'000, 3000);
  }
  std::size_t found = 0;
  const double time = milliseconds([&] { found = Library::open_read_only(path).clips().size(); });
  EXPECT_EQ(found, 10'000U);
  RecordProperty("list_ms", std::to_string(time));
  EXPECT_LT(time, 50 * slow);
}

TEST(LibrarySpeed, the_retrieval_vectors_of_1142_clips_are_there_in_10_ms) {
  const test::TemporaryFolder folder;
  const auto path = folder / "a.kspace";
  {
    Library library = Library::create(path);
    test::fill_sample(library, 1142, 30'000, 256);
  }
  RetrievalMatrix matrix;
  const double time = milliseconds([&] { matrix = Library::open_read_only(path).retrieval_matrix(1); });
  EXPECT_EQ(matrix.values.size(), 1142U * 256U);
  RecordProperty("retrieval_ms", std::to_string(time));
  EXPECT_LT(time, 10 * slow);

  std::size_t bytes = 0;
  const double pass = milliseconds([&] {
    bytes = 0;
    Library::open_read_only(path).for_each_blob(
        1, ClipBlob::vectors, [&bytes](std::int64_t, std::span<const std::byte> blob) { bytes += blob.size(); });
  });
  EXPECT_GT(bytes, 1142U * 30'000U);
  RecordProperty("pass_ms", std::to_string(pass));
  EXPECT_LT(pass, 200 * slow);
}

}  // namespace
}  // namespace kinespace
