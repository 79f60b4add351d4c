#include "kinespace/storage/library.h"

#include <cmath>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "tests/storage/sample_library.h"
#include "tests/storage/sample_stream.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::error_of;
using test::fill_sample;
using test::in_child;
using test::sample_blobs;
using test::sample_row;
using test::TemporaryFolder;
using test::to_bytes;
using testing::ElementsAre;
using testing::HasSubstr;

class LibraryTest : public testing::Test {
 protected:
  // A library in memory of the test's folder, with one space and one skeleton.
  LibraryTest() : library_(Library::create(folder_ / "a.kspace")) {
    space_ = library_.put_space({.name = "all", .tree_hash = "t", .blob = to_bytes("basis")});
    skeleton_ = library_.add_skeleton({.name = "s", .tree_hash = "t", .blob = to_bytes("joints")});
  }
  std::int64_t add(int number) {
    return library_.add_clip(sample_row(number, space_, skeleton_), sample_blobs(number));
  }

  TemporaryFolder folder_;
  Library library_;
  std::int64_t space_ = 0;
  std::int64_t skeleton_ = 0;
};

TEST(Library, what_was_written_comes_back_after_reopening) {
  const TemporaryFolder folder;
  {
    Library library = Library::create(folder / "a.kspace");
    fill_sample(library, 10);
  }
  EXPECT_EQ(test::expect_sample(Library::open_read_only(folder / "a.kspace")), 10);
  EXPECT_EQ(test::expect_sample(Library::open(folder / "a.kspace")), 10);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.kspace-journal"));
}

TEST_F(LibraryTest, clips_are_found_by_their_exact_name_whatever_is_in_it) {
  const std::vector<std::string> names = {"plain",
                                          "with space",
                                          "it's",
                                          "\"quoted\"",
                                          "a:b",
                                          "50%_*?",
                                          "Plain",
                                          "\xe6\xad\xa9\xe3\x81\x8f",
                                          "x'; DROP TABLE clips; --",
                                          std::string("zero\0byte", 9),
                                          "not utf-8 \xff\xfe",
                                          std::string(5000, 'n')};
  for (std::size_t i = 0; i < names.size(); ++i) {
    ClipRow row = sample_row(static_cast<int>(i), space_, skeleton_);
    row.name = names[i];
    row.labels = {names[i], "", names[i]};
    library_.add_clip(row, {});
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto found = library_.find_clip(names[i]);
    ASSERT_TRUE(found) << names[i];
    EXPECT_EQ(found->frames, 100 + static_cast<int>(i)) << names[i];
    EXPECT_EQ(found->name, names[i]);
    EXPECT_THAT(found->labels, ElementsAre(names[i], "", names[i]));
  }
  EXPECT_FALSE(library_.find_clip("plai"));
  EXPECT_FALSE(library_.find_clip("plain "));
  EXPECT_FALSE(library_.find_clip("%"));
  EXPECT_EQ(library_.clips().size(), names.size());
}

TEST_F(LibraryTest, a_second_clip_of_a_name_names_both_sources_and_changes_nothing) {
  add(1);
  ClipRow row = sample_row(1, space_, skeleton_);
  row.source = "/elsewhere/clip 1.bvh";
  const Error error = error_of([&] { library_.add_clip(row, {}); });
  EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  EXPECT_THAT(error.what(), HasSubstr("/elsewhere/clip 1.bvh"));
  EXPECT_THAT(error.what(), HasSubstr("/motions of mine/clip 1.bvh"));
  EXPECT_EQ(library_.clips().size(), 1U);
}

TEST_F(LibraryTest, rows_that_cannot_be_are_refused) {
  const auto refused = [&](const std::function<void(ClipRow&)>& spoil) {
    ClipRow row = sample_row(1, space_, skeleton_);
    spoil(row);
    const Error error = error_of([&] { library_.add_clip(row, {}); });
    EXPECT_EQ(error.kind(), ErrorKind::usage) << error.what();
    EXPECT_TRUE(library_.clips().empty());
  };
  refused([](ClipRow& row) { row.rate_hz = 0; });
  refused([](ClipRow& row) { row.rate_hz = std::nan(""); });
  refused([](ClipRow& row) { row.rate_hz = INFINITY; });
  refused([](ClipRow& row) { row.frames = 0; });
  refused([](ClipRow& row) { row.name.clear(); });
  refused([](ClipRow& row) { row.space_id = 99; });
  refused([](ClipRow& row) { row.skeleton_id = 99; });
}

TEST_F(LibraryTest, what_is_not_there_is_said) {
  EXPECT_THAT(error_of([&] { static_cast<void>(library_.clip(5)); }).what(), HasSubstr("no clip with the id 5"));
  EXPECT_THAT(error_of([&] { static_cast<void>(library_.clip_blob(5, ClipBlob::side)); }).what(), HasSubstr("no clip"));
  EXPECT_THAT(error_of([&] { static_cast<void>(library_.space(9)); }).what(), HasSubstr("no motion space"));
  EXPECT_THAT(error_of([&] { static_cast<void>(library_.skeleton(9)); }).what(), HasSubstr("no skeleton"));
  EXPECT_EQ(library_.metadata("x"), std::nullopt);
  EXPECT_EQ(library_.artifact("a", "b"), std::nullopt);
  EXPECT_EQ(library_.retrieval_matrix(space_).dimensions, 0U);
}

TEST_F(LibraryTest, equal_skeletons_share_a_row_and_others_do_not) {
  const auto again = library_.add_skeleton({.name = "other", .tree_hash = "t", .blob = to_bytes("joints")});
  const auto longer = library_.add_skeleton({.name = "tall", .tree_hash = "t", .blob = to_bytes("joints, longer")});
  EXPECT_EQ(again, skeleton_);
  EXPECT_NE(longer, skeleton_);
  EXPECT_EQ(library_.skeletons().size(), 2U);
  EXPECT_EQ(library_.skeleton(longer).name, "tall");
}

TEST_F(LibraryTest, a_space_that_is_put_again_keeps_its_id_and_its_clips) {
  const std::int64_t clip = add(1);
  EXPECT_EQ(library_.put_space({.name = "all", .tree_hash = "t", .blob = to_bytes("better")}), space_);
  EXPECT_EQ(library_.space(space_).blob, to_bytes("better"));
  EXPECT_EQ(library_.clip(clip).space_id, space_);
  EXPECT_EQ(library_.spaces().size(), 1U);
}

TEST_F(LibraryTest, replaced_blobs_replace_and_a_removed_clip_takes_all_of_its_rows_along) {
  const std::int64_t first = add(1);
  const std::int64_t second = add(2);
  library_.replace_clip_blobs(first, sample_blobs(7));
  EXPECT_EQ(library_.clip_blob(first, ClipBlob::vectors), sample_blobs(7).vectors);
  EXPECT_EQ(library_.retrieval_vector(first), sample_blobs(7).retrieval);
  library_.remove_clip(first);
  EXPECT_FALSE(library_.find_clip(sample_row(1, 0, 0).name));
  EXPECT_THROW(static_cast<void>(library_.clip_blob(first, ClipBlob::vectors)), Error);
  EXPECT_THAT(library_.retrieval_matrix(space_).clip_ids, ElementsAre(second));
  EXPECT_EQ(library_.totals().retrieval_bytes, 8 * 4);
  EXPECT_THROW(library_.remove_clip(first), Error);
}

TEST_F(LibraryTest, a_pass_over_blobs_keeps_to_its_space_and_goes_by_id) {
  const auto other = library_.put_space({.name = "other", .tree_hash = "t", .blob = {}});
  const std::int64_t a = add(0);
  library_.add_clip(sample_row(1, other, skeleton_), sample_blobs(1));
  const std::int64_t c = add(2);
  std::vector<std::int64_t> seen;
  library_.for_each_blob(space_, ClipBlob::vectors, [&](std::int64_t id, std::span<const std::byte> blob) {
    seen.push_back(id);
    const Bytes expected = library_.clip_blob(id, ClipBlob::vectors);  // reading inside the pass is fine
    EXPECT_TRUE(std::ranges::equal(blob, expected));
  });
  EXPECT_THAT(seen, ElementsAre(a, c));
  const RetrievalMatrix matrix = library_.retrieval_matrix(space_);
  EXPECT_THAT(matrix.clip_ids, ElementsAre(a, c));
  ASSERT_EQ(matrix.dimensions, 8U);
  EXPECT_EQ(matrix.values[8 + 1], sample_blobs(2).retrieval[1]);
}

TEST_F(LibraryTest, artifacts_are_kept_by_kind_and_key) {
  library_.put_artifact("graph", "b", to_bytes("1"));
  library_.put_artifact("graph", "a", {});
  library_.put_artifact("contacts", "a", to_bytes("2"));
  library_.put_artifact("graph", "b", to_bytes("3"));
  EXPECT_THAT(library_.artifact_keys("graph"), ElementsAre("a", "b"));
  EXPECT_EQ(library_.artifact("graph", "b"), to_bytes("3"));
  EXPECT_EQ(library_.artifact("graph", "a"), Bytes());
  library_.remove_artifact("graph", "b");
  EXPECT_THAT(library_.artifact_keys("graph"), ElementsAre("a"));
  EXPECT_EQ(library_.artifact("contacts", "a"), to_bytes("2"));
}

TEST_F(LibraryTest, totals_add_up) {
  add(0);
  add(1);
  const LibraryTotals totals = library_.totals();
  EXPECT_EQ(totals.clips, 2);
  EXPECT_EQ(totals.skeletons, 1);
  EXPECT_EQ(totals.spaces, 1);
  EXPECT_EQ(totals.frames, 201);
  EXPECT_DOUBLE_EQ(totals.seconds, 100 / 30.0 + 101 / 31.0);
  EXPECT_EQ(totals.space_bytes, 5);
  EXPECT_EQ(totals.side_bytes, 0);
  EXPECT_EQ(totals.retrieval_bytes, 2 * 8 * 4);
  EXPECT_EQ(totals.vector_bytes,
            static_cast<std::int64_t>(sample_blobs(0).vectors.size() + sample_blobs(1).vectors.size()));
  EXPECT_EQ(totals.file_bytes, static_cast<std::int64_t>(std::filesystem::file_size(library_.path())));
}

TEST_F(LibraryTest, a_transaction_that_is_not_committed_leaves_nothing) {
  {
    Transaction outer(library_);
    add(1);
  }
  EXPECT_TRUE(library_.clips().empty());
  Transaction outer(library_);
  add(2);
  {
    Transaction inner(library_);
    add(3);
  }
  {
    Transaction inner(library_);
    add(4);
    inner.commit();
  }
  outer.commit();
  const Library seen = Library::open_read_only(library_.path());
  ASSERT_EQ(seen.clips().size(), 2U);
  EXPECT_EQ(seen.clips()[1].name, sample_row(4, 0, 0).name);
}

TEST_F(LibraryTest, opened_to_read_it_cannot_be_written) {
  Library reader = Library::open_read_only(library_.path());
  const Error error = error_of([&] { reader.set_metadata("a", "b"); });
  EXPECT_EQ(error.kind(), ErrorKind::machine);
  EXPECT_THAT(error.what(), HasSubstr("a.kspace"));
}

TEST_F(LibraryTest, a_library_is_not_created_over_a_file) {
  EXPECT_EQ(error_of([&] { static_cast<void>(Library::create(library_.path())); }).kind(), ErrorKind::usage);
}

TEST_F(LibraryTest, its_first_bytes_tell_it_from_other_files) {
  EXPECT_TRUE(Library::looks_like_library(FileContent(library_.path()).bytes()));
  EXPECT_FALSE(Library::looks_like_library(to_bytes("HIERARCHY")));
  EXPECT_FALSE(Library::looks_like_library({}));
}

TEST(Library, a_file_that_is_none_is_said_to_be_none) {
  const TemporaryFolder folder;
  const auto message = [&](const char* name) {
    const Error error = error_of([&] { static_cast<void>(Library::open_read_only(folder / name)); });
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_THAT(error.what(), HasSubstr(name));
    return std::string(error.what());
  };
  write_file_atomically(folder / "empty", std::string_view());
  write_file_atomically(folder / "text", std::string(5000, 'x'));
  write_file_atomically(folder / "short", std::string_view("SQLite format 3"));
  std::filesystem::create_directory(folder / "directory");
  EXPECT_THAT(message("missing"), HasSubstr("no such file"));
  EXPECT_THAT(message("directory"), HasSubstr("a folder"));
  EXPECT_THAT(message("empty"), HasSubstr("an empty file"));
  EXPECT_THAT(message("text"), HasSubstr("not a kinespace library"));
  EXPECT_THAT(message("short"), HasSubstr("not a kinespace library"));
}

TEST(Library, names_that_sqlite_gives_a_meaning_are_just_names) {
  const TemporaryFolder folder;
  for (const char* name : {":memory:", "file:a?mode=ro", "a b'\"c.kspace", "%41"}) {
    { Library library = Library::create(folder / name); }
    EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
    EXPECT_NO_THROW(static_cast<void>(Library::open_read_only(folder / name))) << name;
  }
}

TEST(Library, a_folder_that_cannot_be_written_is_the_machines_error) {
  const TemporaryFolder folder;
  EXPECT_EQ(error_of([&] { static_cast<void>(Library::create(folder / "no/such/a.kspace")); }).kind(),
            ErrorKind::machine);
}

TEST(Library, a_read_only_library_in_a_read_only_folder_is_read) {
  const TemporaryFolder folder;
  const auto path = folder / "a.kspace";
  {
    Library library = Library::create(path);
    fill_sample(library, 3);
  }
  ::chmod(path.c_str(), 0444);
  ::chmod(folder.path().c_str(), 0555);
  // Root may write anywhere, so the child becomes nobody first.
  const int status = in_child([&] {
    if (::getuid() == 0 && ::setuid(65534) != 0) return 99;
    if (test::expect_sample(Library::open_read_only(path)) != 3) return 98;
    static_cast<void>(Library::create(folder / "b.kspace"));
    return 97;
  });
  EXPECT_EQ(status, static_cast<int>(ErrorKind::machine)) << "reading worked, making a second one did not";
  ::chmod(folder.path().c_str(), 0755);
}

TEST(Library, two_writers_in_place_wait_for_each_other_and_then_say_so) {
  const TemporaryFolder folder;
  const auto path = folder / "a.kspace";
  { Library library = Library::create(path); }
  const test::Background holder([&](const std::function<void()>& ready) {
    Library first = Library::open(path);
    Transaction held(first);
    ready();
    ::pause();
  });
  Library second = Library::open(path);
  const Error error = error_of([&] { second.set_metadata("a", "b"); });
  EXPECT_EQ(error.kind(), ErrorKind::machine);
  EXPECT_THAT(error.what(), HasSubstr("in use by another process"));
}

}  // namespace
}  // namespace kinespace
