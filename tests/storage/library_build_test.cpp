#include "kinespace/storage/library_build.h"

#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
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
using test::TemporaryFolder;
using test::to_bytes;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

std::vector<std::string> files_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.push_back(entry.path().filename());
  return names;
}

void build_sample(const std::filesystem::path& path, int clips) {
  LibraryBuild build(path, {.fingerprint = "f"});
  fill_sample(build.library(), clips);
  build.finish();
}

class LibraryBuildTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::filesystem::path target_ = folder_ / "my moves.kspace";
};

TEST_F(LibraryBuildTest, a_finished_build_leaves_the_library_and_nothing_else) {
  {
    LibraryBuild build(target_, {.fingerprint = "f"});
    EXPECT_EQ(build.resumed_imports(), 0);
    build.keep_import("a", to_bytes("imported"));
    fill_sample(build.library(), 5);
    EXPECT_FALSE(std::filesystem::exists(target_)) << "not before it is complete";
    build.finish();
  }
  EXPECT_THAT(files_in(folder_.path()), ElementsAre("my moves.kspace"));
  EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), 5);
  EXPECT_NO_THROW(Library::open_read_only(target_).check());
}

TEST_F(LibraryBuildTest, a_build_that_ends_early_keeps_its_imports_for_the_next_one) {
  build_sample(target_, 3);
  {
    LibraryBuild build(target_, {.fingerprint = "f"});
    build.keep_import("hash of 'a'", to_bytes("1"));
    build.keep_import("b", to_bytes("2"));
    build.keep_import("b", to_bytes("3"));
    fill_sample(build.library(), 100);
  }
  EXPECT_THAT(files_in(folder_.path()), UnorderedElementsAre("my moves.kspace", "my moves.kspace.partial"));
  EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), 3) << "the old one";

  LibraryBuild build(target_, {.fingerprint = "f"});
  EXPECT_EQ(build.resumed_imports(), 2);
  EXPECT_THAT(build.import_keys(), ElementsAre("hash of 'a'", "b"));
  EXPECT_EQ(build.find_import("b"), to_bytes("3"));
  EXPECT_EQ(build.find_import("c"), std::nullopt);
  EXPECT_TRUE(build.library().clips().empty()) << "rows are made anew";
  fill_sample(build.library(), 4);
  build.finish();
  EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), 4);
}

TEST_F(LibraryBuildTest, a_build_that_imported_nothing_leaves_nothing) {
  { LibraryBuild build(target_, {.fingerprint = "f"}); }
  EXPECT_TRUE(files_in(folder_.path()).empty());
}

TEST_F(LibraryBuildTest, imports_of_other_options_are_thrown_away) {
  {
    LibraryBuild build(target_, {.fingerprint = "f"});
    build.keep_import("a", to_bytes("1"));
  }
  LibraryBuild build(target_, {.fingerprint = "g"});
  EXPECT_EQ(build.resumed_imports(), 0);
  EXPECT_EQ(build.find_import("a"), std::nullopt);
}

TEST_F(LibraryBuildTest, a_damaged_partial_file_costs_the_imports_and_nothing_else) {
  const std::filesystem::path partial = target_.string() + ".partial";
  Bytes good;
  {
    LibraryBuild build(target_, {.fingerprint = "f"});
    for (int i = 0; i < 20; ++i) build.keep_import(std::to_string(i), Bytes(3000, static_cast<std::byte>(i)));
    build.checkpoint();
    const FileContent file(partial);
    good.assign(file.bytes().begin(), file.bytes().end());
  }
  for (std::size_t at = 0; at < good.size(); at += 297) {
    Bytes bad = good;
    bad[at] ^= std::byte{0xff};
    if (at % 2 == 0) bad.resize(at);
    test::write_unflushed(partial, bad);
    SCOPED_TRACE(at);
    LibraryBuild build(target_, {.fingerprint = "f"});
    for (const std::string& key : build.import_keys()) {
      const std::optional<Bytes> kept = build.find_import(key);
      if (!kept) continue;
      EXPECT_EQ(kept->size(), 3000U);
      EXPECT_EQ(kept->front(), kept->back());
    }
    build.keep_import("new", to_bytes("x"));
    build.checkpoint();
    EXPECT_EQ(build.find_import("new"), to_bytes("x"));
  }
}

TEST_F(LibraryBuildTest, extending_starts_from_the_rows_that_are_there) {
  build_sample(target_, 3);
  LibraryBuild build(target_, {.fingerprint = "f", .extend = true});
  EXPECT_EQ(test::expect_sample(build.library()), 3);
  fill_sample(build.library(), 0);
  const auto skeleton = build.library().skeletons()[0].id;
  const auto space = build.library().spaces()[0].id;
  build.library().add_clip(test::sample_row(3, space, skeleton), test::sample_blobs(3));
  EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), 3) << "the old one until the end";
  build.finish();
  EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), 4);
  EXPECT_THAT(files_in(folder_.path()), ElementsAre("my moves.kspace"));
}

TEST_F(LibraryBuildTest, imports_for_a_library_that_has_changed_since_are_thrown_away) {
  build_sample(target_, 3);
  {
    LibraryBuild build(target_, {.fingerprint = "f", .extend = true});
    build.keep_import("a", to_bytes("1"));
  }
  EXPECT_EQ(LibraryBuild(target_, {.fingerprint = "f", .extend = true}).resumed_imports(), 1);
  Library::open(target_).set_metadata("changed", "yes");
  EXPECT_EQ(LibraryBuild(target_, {.fingerprint = "f", .extend = true}).resumed_imports(), 0);
}

TEST_F(LibraryBuildTest, what_cannot_be_extended_is_an_error_and_stays) {
  const LibraryBuildOptions extend{.fingerprint = "f", .extend = true};
  EXPECT_EQ(error_of([&] { LibraryBuild build(target_, extend); }).kind(), ErrorKind::bad_input);
  build_sample(target_, 3);
  std::filesystem::resize_file(target_, std::filesystem::file_size(target_) / 2);
  EXPECT_EQ(error_of([&] { LibraryBuild build(target_, extend); }).kind(), ErrorKind::bad_input);
  EXPECT_NO_THROW(build_sample(target_, 2)) << "but it can be built again";
}

TEST_F(LibraryBuildTest, a_file_of_another_sort_is_never_overwritten) {
  const auto clip = folder_ / "walk.bvh";
  write_file_atomically(clip, std::string_view("HIERARCHY\n"));
  const Error error = error_of([&] { build_sample(clip, 1); });
  EXPECT_EQ(error.kind(), ErrorKind::usage);
  EXPECT_THAT(error.what(), HasSubstr("walk.bvh"));
  EXPECT_EQ(FileContent(clip).text(), "HIERARCHY\n");
  EXPECT_EQ(error_of([&] { build_sample(folder_.path(), 1); }).kind(), ErrorKind::usage);
}

TEST_F(LibraryBuildTest, a_place_that_cannot_be_written_is_said_at_once) {
  const Error error = error_of([&] { build_sample(folder_ / "no/such/a.kspace", 1); });
  EXPECT_EQ(error.kind(), ErrorKind::machine);
  EXPECT_THAT(error.what(), HasSubstr("no/such/a.kspace"));
}

TEST_F(LibraryBuildTest, a_second_build_of_the_same_library_is_told_of_the_first) {
  const test::Background first([&](const std::function<void()>& ready) {
    LibraryBuild build(target_, {.fingerprint = "f"});
    build.keep_import("a", to_bytes("1"));
    build.checkpoint();
    ready();
    ::pause();
  });
  const Error error = error_of([&] { LibraryBuild build(target_, {.fingerprint = "f"}); });
  EXPECT_EQ(error.kind(), ErrorKind::machine);
  EXPECT_THAT(error.what(), HasSubstr("another process is building this library"));
  EXPECT_NO_THROW(build_sample(folder_ / "another.kspace", 1)) << "only of the same library";
  // By another name of it, too.
  std::filesystem::create_directory_symlink(folder_.path(), folder_ / "link");
  EXPECT_EQ(error_of([&] { build_sample(folder_ / "link/my moves.kspace", 1); }).kind(), ErrorKind::machine);
}

TEST_F(LibraryBuildTest, a_link_to_a_library_stays_a_link) {
  std::filesystem::create_directory(folder_ / "store");
  build_sample(folder_ / "store/a.kspace", 1);
  std::filesystem::create_symlink(folder_ / "store/a.kspace", target_);
  build_sample(target_, 2);
  EXPECT_TRUE(std::filesystem::is_symlink(target_));
  EXPECT_EQ(test::expect_sample(Library::open_read_only(folder_ / "store/a.kspace")), 2);
}

TEST_F(LibraryBuildTest, readers_keep_the_library_they_opened) {
  build_sample(target_, 3);
  const Library reader = Library::open_read_only(target_);
  build_sample(target_, 6);
  EXPECT_EQ(test::expect_sample(reader), 3);
  EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), 6);
}

TEST_F(LibraryBuildTest, holes_of_replaced_rows_are_not_shipped) {
  LibraryBuild build(target_, {.fingerprint = "f"});
  fill_sample(build.library(), 100, 20000);
  for (const ClipRow& clip : build.library().clips()) {
    build.library().replace_clip_blobs(clip.id, test::sample_blobs(static_cast<int>(clip.id) - 1, 100));
  }
  build.finish();
  EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), 100);
  EXPECT_LT(std::filesystem::file_size(target_), 300'000U);
}

TEST_F(LibraryBuildTest, vectors_that_cannot_stand_in_one_matrix_are_refused) {
  LibraryBuild build(target_, {.fingerprint = "f"});
  fill_sample(build.library(), 2);
  const ClipRow clip = build.library().clips()[1];
  build.library().replace_clip_blobs(clip.id, test::sample_blobs(1, 10, 9));
  const Error error = error_of([&] { build.finish(); });
  EXPECT_EQ(error.kind(), ErrorKind::usage);
  EXPECT_FALSE(std::filesystem::exists(target_));
}

TEST_F(LibraryBuildTest, imports_come_from_several_threads) {
  LibraryBuild build(target_, {.fingerprint = "f", .imports_per_commit = 7});
  std::vector<std::jthread> threads;
  threads.reserve(4);
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&build, t] {
      for (int i = 0; i < 50; ++i) {
        const std::string key = std::to_string(t * 1000 + i);
        build.keep_import(key, to_bytes(key));
        EXPECT_EQ(build.find_import(key), to_bytes(key));
      }
    });
  }
  threads.clear();
  EXPECT_EQ(build.import_keys().size(), 200U);
}

TEST_F(LibraryBuildTest, options_out_of_range_are_named) {
  EXPECT_THAT(error_of([&] { LibraryBuild build(target_, {.fingerprint = ""}); }).what(), HasSubstr("fingerprint"));
  EXPECT_THAT(error_of([&] { LibraryBuild build(target_, {.fingerprint = "f", .imports_per_commit = 0}); }).what(),
              HasSubstr("imports_per_commit = 0"));
}

// The journal of a writer in place that was killed belongs to the old file, not to the one that takes its place.
TEST_F(LibraryBuildTest, the_journal_of_a_killed_writer_does_not_reach_the_new_library) {
  build_sample(target_, 3);
  const std::string journal = target_.string() + "-journal";
  {
    const test::Background writer([&](const std::function<void()>& ready) {
      Library library = Library::open(target_);
      Transaction together(library);
      for (int i = 0; i < 40; ++i) library.put_artifact("big", std::to_string(i), Bytes(1'000'000));
      ready();
      ::pause();
    });
    ASSERT_TRUE(std::filesystem::exists(journal));
  }
  ASSERT_TRUE(std::filesystem::exists(journal));
  build_sample(target_, 7);
  EXPECT_FALSE(std::filesystem::exists(journal));
  EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), 7);
  EXPECT_NO_THROW(Library::open_read_only(target_).check());
}

TEST_F(LibraryBuildTest, a_library_whose_writer_was_killed_is_read_as_it_was_before) {
  build_sample(target_, 3);
  {
    const test::Background writer([&](const std::function<void()>& ready) {
      Library library = Library::open(target_);
      Transaction together(library);
      for (int i = 0; i < 40; ++i) library.put_artifact("big", std::to_string(i), Bytes(1'000'000));
      ready();
      ::pause();
    });
  }
  const Library library = Library::open_read_only(target_);
  EXPECT_EQ(test::expect_sample(library), 3);
  EXPECT_TRUE(library.artifact_keys("big").empty());
}

// A disk of `bytes` for each file: writing beyond it fails as a full disk does.
void limit_files_to(std::uint64_t bytes) {
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{bytes, bytes};
  ::setrlimit(RLIMIT_FSIZE, &limit);
}

TEST_F(LibraryBuildTest, a_full_disk_at_any_moment_is_reported_and_loses_nothing) {
  build_sample(target_, 3);
  int failures = 0;
  std::int64_t kept = 0;
  for (std::uint64_t room = 0; room < 900'000; room += 40'000) {
    const int status = in_child([&] {
      limit_files_to(room);
      LibraryBuild build(target_, {.fingerprint = "f", .imports_per_commit = 1});
      for (int i = 0; i < 20; ++i) build.keep_import(std::to_string(i), Bytes(5000, std::byte{1}));
      fill_sample(build.library(), 100, 2000);
      build.finish();
      return 0;
    });
    if (status == 0) break;
    EXPECT_EQ(status, static_cast<int>(ErrorKind::machine)) << room;
    EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), 3) << room;
    const LibraryBuild again(target_, {.fingerprint = "f"});
    EXPECT_GE(again.resumed_imports(), kept) << "what was imported stays";
    kept = again.resumed_imports();
    ++failures;
  }
  EXPECT_GT(failures, 5);
  EXPECT_EQ(kept, 20) << "the last failures were behind the imports";
  EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), 100) << "and with room enough it is built";
}

TEST_F(LibraryBuildTest, a_full_disk_while_writing_in_place_takes_the_transaction_back) {
  build_sample(target_, 3);
  const int status = in_child([&] {
    limit_files_to(std::filesystem::file_size(target_) + 100'000);
    Library library = Library::open(target_);
    Transaction together(library);
    for (int i = 0; i < 1000; ++i) library.put_artifact("big", std::to_string(i), Bytes(100'000));
    together.commit();
    return 0;
  });
  EXPECT_EQ(status, static_cast<int>(ErrorKind::machine));
  const Library library = Library::open_read_only(target_);
  EXPECT_EQ(test::expect_sample(library), 3);
  EXPECT_TRUE(library.artifact_keys("big").empty());
}

}  // namespace
}  // namespace kinespace
