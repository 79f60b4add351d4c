// What queries and listings read of a library: what they are about, and not the rest of the file. A wrong layout reads
// it all.
#include <filesystem>

#include <gtest/gtest.h>

#include "tests/storage/disk_meter.h"
#include "tests/storage/sample_library.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

TEST(LibraryReads, ten_thousand_clips_are_listed_without_their_blobs) {
  const test::TemporaryFolder folder;
  const auto path = folder / "a.kspace";
  {
    Library library = Library::create(path);
    test::fill_sample(library, 10'000, 3000);
  }
  const test::DiskMeter disk;
  EXPECT_EQ(Library::open_read_only(path).clips().size(), 10'000U);
  EXPECT_LT(disk.bytes_read(), static_cast<std::int64_t>(std::filesystem::file_size(path) / 8));
}

TEST(LibraryReads, the_retrieval_vectors_of_1142_clips_are_read_alone_and_a_pass_reads_blobs_once) {
  const test::TemporaryFolder folder;
  const auto path = folder / "a.kspace";
  constexpr std::int64_t vectors = 1142 * 256;
  {
    Library library = Library::create(path);
    test::fill_sample(library, 1142, 30'000, 256);
  }
  {
    const test::DiskMeter disk;
    EXPECT_EQ(Library::open_read_only(path).retrieval_matrix(1).values.size(), static_cast<std::size_t>(vectors));
    EXPECT_LT(disk.bytes_read(), 2 * vectors * static_cast<std::int64_t>(sizeof(float)));
  }
  std::int64_t bytes = 0;
  const test::DiskMeter disk;
  Library::open_read_only(path).for_each_blob(
      1, ClipBlob::vectors, [&bytes](std::int64_t, std::span<const std::byte> blob) { bytes += std::ssize(blob); });
  EXPECT_GT(bytes, 1142 * 30'000);
  EXPECT_LT(disk.bytes_read(), bytes + bytes / 8);
}

}  // namespace
}  // namespace kinespace
