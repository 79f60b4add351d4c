// What a library may hold: our tables and nothing else, whatever it does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/storage/detail/sqlite.h"
#include "kinespace/storage/library_build.h"
#include "tests/storage/sample_library.h"
#include "tests/storage/sample_stream.h"
#include "tests/support/allocation_meter.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::error_of;
using testing::HasSubstr;

class LibrarySchema : public testing::Test {
 protected:
  LibrarySchema() {
    Library library = Library::create(path_);
    test::fill_sample(library, 5);
  }

  void change(const std::string& sql) const {
    sqlite::Database(path_, sqlite::Mode::read_write, "changed").execute(sql.c_str());
  }

  // Adds nothing: the library is copied and put in place.
  void extend() const {
    LibraryBuild build(path_, {.fingerprint = "f", .extend = true});
    static_cast<void>(build.library());
    build.finish();
  }

  [[nodiscard]] bool holds(std::string_view text) const {
    return FileContent(path_).text().find(text) != std::string_view::npos;
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "a.kspace";
};

class ForeignThings : public LibrarySchema, public testing::WithParamInterface<const char*> {};

TEST_P(ForeignThings, are_refused_however_the_library_is_opened) {
  change(GetParam());
  for (const auto& open : std::vector<std::function<void()>>{
           [&] { static_cast<void>(Library::open_read_only(path_)); },
           [&] { static_cast<void>(Library::open(path_)); },
           [&] { LibraryBuild(path_, {.fingerprint = "f", .extend = true}); },
       }) {
    const Error error = error_of(open);
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_THAT(error.what(), HasSubstr("that kinespace did not make"));
    EXPECT_THAT(error.what(), HasSubstr("strange"));
  }
}

INSTANTIATE_TEST_SUITE_P(All, ForeignThings,
                         testing::Values("CREATE INDEX strange ON clips(name)",
                                         "CREATE UNIQUE INDEX strange ON clip_vectors(blob)",
                                         "CREATE INDEX strange ON clips(hex(zeroblob(frames))) WHERE frames > 0",
                                         "CREATE INDEX \"sqlite%autoindex strange\" ON clips(name)",
                                         "CREATE VIEW strange AS SELECT * FROM clips",
                                         "CREATE TRIGGER strange AFTER INSERT ON clips BEGIN DELETE FROM clips; END",
                                         "CREATE TABLE strange(a)", "CREATE TABLE strange(a PRIMARY KEY) WITHOUT ROWID",
                                         "CREATE VIRTUAL TABLE strange USING rtree(id, low, high)"));

TEST_F(LibrarySchema, statistics_are_not_ours_either) {
  change("ANALYZE");
  EXPECT_THAT(error_of([&] { static_cast<void>(Library::open(path_)); }).what(), HasSubstr("sqlite_stat1"));
}

TEST_F(LibrarySchema, the_indices_of_keys_belong_to_the_tables) {
  EXPECT_NO_THROW(static_cast<void>(Library::open(path_)));
  const Library fixture = Library::open_read_only(std::filesystem::path(KINESPACE_FIXTURES) / "library_v1.kspace");
  EXPECT_FALSE(fixture.clips().empty());
}

TEST_F(LibrarySchema, extending_keeps_every_row_and_its_id) {
  const auto ids = [&] {
    std::vector<std::int64_t> out;
    for (const ClipRow& row : Library::open_read_only(path_).clips()) out.push_back(row.id);
    return out;
  };
  const std::vector<std::int64_t> before = ids();
  extend();
  const Library library = Library::open_read_only(path_);
  EXPECT_EQ(test::expect_sample(library), 5);
  EXPECT_EQ(ids(), before);
  EXPECT_NO_THROW(library.check());
}

TEST_F(LibrarySchema, extending_takes_nothing_along_but_rows) {
  {
    Library library = Library::open(path_);
    library.put_artifact("kept", "k", test::to_bytes("words that are kept"));
  }
  change(
      "PRAGMA secure_delete=OFF; INSERT INTO artifacts VALUES('gone', 'k', CAST('words that were removed' AS BLOB));"
      "DELETE FROM artifacts WHERE kind = 'gone'");
  ASSERT_TRUE(holds("words that were removed")) << "SQLite leaves them in free space";
  extend();
  EXPECT_FALSE(holds("words that were removed"));
  EXPECT_TRUE(holds("words that are kept"));
}

TEST_F(LibrarySchema, extending_holds_a_row_in_memory_and_not_the_library) {
  constexpr std::size_t rows = 96, row_bytes = 1 << 20;
  {
    Library library = Library::open(path_);
    Transaction together(library);
    for (std::size_t i = 0; i < rows; ++i)
      library.put_artifact("big", std::to_string(i), Bytes(row_bytes, std::byte{7}));
    together.commit();
  }
  const test::AllocationMeter meter;
  extend();
  // Two caches of 16 MiB, the row, and its copy on the way.
  if (test::AllocationMeter::counts()) {
    EXPECT_LT(meter.peak(), 48U << 20);
  }
  EXPECT_EQ(Library::open_read_only(path_).artifact_keys("big").size(), rows);
}

TEST_F(LibrarySchema, rows_that_cannot_be_are_damage) {
  change("PRAGMA foreign_keys=OFF; DELETE FROM skeletons");
  const Error error = error_of([&] { extend(); });
  EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  EXPECT_THAT(error.what(), HasSubstr("a row of clips that cannot be"));
}

TEST_F(LibrarySchema, facts_that_are_no_numbers_are_damage) {
  Library library = Library::open(path_);
  EXPECT_EQ(library.metadata_count("n"), std::nullopt);
  EXPECT_EQ(library.metadata_number("n"), std::nullopt);
  library.set_metadata("n", "234");
  EXPECT_EQ(library.metadata_count("n"), 234);
  library.set_metadata("n", "0.999999000");
  EXPECT_EQ(library.metadata_number("n"), 0.999999);
  for (const char* text : {"", " 1", "many", "1 ", "1,5", "99999999999999999999", "nan", "[[[["}) {
    library.set_metadata("n", text);
    EXPECT_EQ(error_of([&] { static_cast<void>(library.metadata_count("n")); }).kind(), ErrorKind::bad_input) << text;
  }
  for (const char* text : {"", " 1", "many", "1 ", "1,5", "1e999", "inf", "nan", "[[[["}) {
    library.set_metadata("n", text);
    EXPECT_EQ(error_of([&] { static_cast<void>(library.metadata_number("n")); }).kind(), ErrorKind::bad_input) << text;
  }
}

}  // namespace
}  // namespace kinespace
