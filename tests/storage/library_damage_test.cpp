// Libraries that were cut or changed: an Error{bad_input} or rows, never a crash.
#include <random>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "tests/storage/sample_library.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::survives;
using test::TemporaryFolder;

class LibraryDamage : public testing::Test {
 protected:
  LibraryDamage() {
    const auto path = folder_ / "good.kspace";
    {
      Library library = Library::create(path);
      // Blobs larger than a page, so that there are overflow chains to break.
      test::fill_sample(library, 12, 6000, 64);
    }
    const FileContent file(path);
    good_.assign(file.bytes().begin(), file.bytes().end());
  }

  bool survives_as(std::span<const std::byte> bytes) {
    const auto path = folder_ / "bad.kspace";
    test::write_unflushed(path, bytes);
    return survives(path);
  }

  TemporaryFolder folder_;
  Bytes good_;
};

TEST_F(LibraryDamage, the_sound_library_is_read) {
  EXPECT_TRUE(survives_as(good_));
}

TEST_F(LibraryDamage, cut_at_every_byte_of_its_first_4_kib_it_is_an_error) {
  for (std::size_t size = 0; size < 4096; ++size) EXPECT_FALSE(survives_as(std::span(good_).first(size))) << size;
}

TEST_F(LibraryDamage, cut_at_200_random_places_it_is_an_error) {
  std::mt19937 random(11);
  for (int round = 0; round < 200; ++round) {
    const std::size_t size = random() % good_.size();
    EXPECT_FALSE(survives_as(std::span(good_).first(size))) << size;
  }
}

TEST_F(LibraryDamage, longer_than_it_says_it_is_an_error) {
  Bytes longer = good_;
  longer.resize(longer.size() + 4096);
  EXPECT_FALSE(survives_as(longer));
}

TEST_F(LibraryDamage, every_flipped_byte_of_its_header_is_an_error_or_rows) {
  for (std::size_t at = 0; at < 100; ++at) {
    for (const int mask : {0x01, 0x40, 0xff}) {
      Bytes flipped = good_;
      flipped[at] ^= static_cast<std::byte>(mask);
      survives_as(flipped);
    }
  }
}

TEST_F(LibraryDamage, flipped_bytes_anywhere_are_errors_or_rows_and_those_in_blobs_are_noticed) {
  std::mt19937 random(12);
  int noticed = 0;
  constexpr int rounds = 1500;
  for (int round = 0; round < rounds; ++round) {
    Bytes flipped = good_;
    flipped[random() % flipped.size()] ^= static_cast<std::byte>(1 + random() % 255);
    noticed += survives_as(flipped) ? 0 : 1;
  }
  // Most of the file is blobs; what goes unnoticed are texts, numbers and unused space.
  EXPECT_GT(noticed, rounds / 2);
}

TEST_F(LibraryDamage, whole_pages_of_rubbish_are_errors_or_rows) {
  std::mt19937 random(13);
  for (std::size_t page = 0; page < good_.size() / 4096; ++page) {
    for (const int kind : {0, 1, 2}) {
      Bytes spoilt = good_;
      const std::size_t other = random() % (good_.size() / 4096);
      for (std::size_t i = 0; i < 4096; ++i) {
        std::byte& byte = spoilt[page * 4096 + i];
        byte = kind == 0 ? std::byte{0} : kind == 1 ? static_cast<std::byte>(random()) : good_[other * 4096 + i];
      }
      survives_as(spoilt);
    }
  }
}

// The version is the 4 bytes at 60, big-endian (PRAGMA user_version).
TEST_F(LibraryDamage, a_newer_library_says_so) {
  good_[63] = std::byte{9};
  const auto path = folder_ / "new.kspace";
  write_file_atomically(path, std::span<const std::byte>(good_));
  try {
    static_cast<void>(Library::open(path));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_NE(std::string(error.what()).find("made by a newer kinespace (library version 9)"), std::string::npos);
  }
}

// The tables are kept as text: a changed one is found by its text, before it is read.
TEST_F(LibraryDamage, a_table_of_another_shape_is_an_error) {
  const std::string wanted = "rate_hz REAL NOT NULL";
  const std::string_view text(reinterpret_cast<const char*>(good_.data()), good_.size());
  const std::size_t at = text.find(wanted);
  ASSERT_NE(at, std::string_view::npos);
  good_[at] = std::byte{'R'};
  EXPECT_FALSE(survives_as(good_));
}

TEST(LibraryVersions, a_library_of_the_first_version_is_still_read) {
  const Library library = Library::open_read_only(std::filesystem::path(KINESPACE_FIXTURES) / "library_v1.kspace");
  EXPECT_EQ(test::expect_sample(library), 3);
}

}  // namespace
}  // namespace kinespace
