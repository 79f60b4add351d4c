#include "kinespace/base/file.h"

#include <array>
#include <atomic>
#include <csignal>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "kinespace/base/error.h"
#include "tests/support/data.h"
#include "tests/support/error_of.h"

namespace kinespace {
namespace {

using test::error_of;
using test::TemporaryFolder;
using testing::HasSubstr;

std::vector<std::string> files_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.push_back(entry.path().filename());
  return names;
}

mode_t mode_of(const std::filesystem::path& path) {
  struct stat status {};
  EXPECT_EQ(::stat(path.c_str(), &status), 0);
  return status.st_mode & 07777;
}

std::string text_of(const std::filesystem::path& path) {
  return std::string(FileContent(path).text());
}

TEST(File, what_was_written_is_read) {
  const TemporaryFolder folder;
  const auto path = folder / "a b'\".txt";
  for (const std::string& content : {std::string(), std::string("x"), std::string(100001, 'y')}) {
    write_file_atomically(path, content);
    EXPECT_EQ(text_of(path), content);
  }
  EXPECT_THAT(files_in(folder.path()), testing::ElementsAre("a b'\".txt")) << "nothing else stays";
}

TEST(File, pieces_follow_the_beginning_and_are_read_and_hashed_piece_by_piece) {
  const TemporaryFolder folder;
  const std::string piece(300'000, 'p');
  const FileToWrite file{folder / "a", "start ", [&](const FileSink& sink) {
                           for (int i = 0; i < 10; ++i) sink(piece);
                         }};
  write_files_atomically(std::span(&file, 1));
  std::string whole = "start ";
  for (int i = 0; i < 10; ++i) whole += piece;
  EXPECT_EQ(text_of(folder / "a"), whole);
  EXPECT_EQ(hash_of_file(folder / "a"), content_hash(std::as_bytes(std::span(whole))));
  EXPECT_EQ(start_of_file(folder / "a"), whole.substr(0, file_kind_bytes));

  FileReader reader(folder / "a");
  std::string room(1'000'000, ' '), read;
  while (reader.remaining() > 0) read.append(room, 0, reader.read(room));
  EXPECT_EQ(read, whole);
}

TEST(File, pieces_that_end_in_an_error_leave_the_old_file) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a", std::string_view("old"));
  const FileToWrite file{folder / "a", "new", [](const FileSink& sink) {
                           sink("half");
                           throw Error(ErrorKind::machine, {.found = "no more"});
                         }};
  EXPECT_EQ(error_of([&] { write_files_atomically(std::span(&file, 1)); }).kind(), ErrorKind::machine);
  EXPECT_EQ(text_of(folder / "a"), "old");
  EXPECT_THAT(files_in(folder.path()), testing::ElementsAre("a"));
}

TEST(File, a_view_outlives_a_move_and_the_replacing_of_its_file) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a", std::string_view("old"));
  FileContent file(folder / "a");
  write_file_atomically(folder / "a", std::string_view("new, longer"));
  FileContent moved = std::move(file);
  EXPECT_EQ(moved.text(), "old");
  moved = FileContent(folder / "a");
  EXPECT_EQ(moved.text(), "new, longer");
  EXPECT_EQ(moved.bytes().size(), 11U);
}

TEST(File, what_cannot_be_read_is_bad_input_with_its_name) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (const char* name : {"missing", "pipe", "."}) {
    const Error error = error_of([&] { FileContent file(folder / name); });
    EXPECT_EQ(error.kind(), ErrorKind::bad_input) << name;
    EXPECT_THAT(error.what(), HasSubstr(name));
  }
}

TEST(File, what_cannot_be_written_is_the_machines_error_and_leaves_nothing) {
  const TemporaryFolder folder;
  const auto missing = folder / "no/such/a.txt";
  EXPECT_EQ(error_of([&] { write_file_atomically(missing, std::string_view("x")); }).kind(), ErrorKind::machine);
  std::filesystem::create_directory(folder / "taken");
  EXPECT_EQ(error_of([&] { write_file_atomically(folder / "taken", std::string_view("x")); }).kind(),
            ErrorKind::machine);
  EXPECT_THAT(files_in(folder.path()), testing::ElementsAre("taken"));
}

TEST(File, a_name_as_long_as_the_disk_allows_can_be_written) {
  const TemporaryFolder folder;
  const std::string name(255, 'n');
  write_file_atomically(folder / name.c_str(), std::string_view("x"));
  EXPECT_EQ(text_of(folder / name.c_str()), "x");
}

TEST(File, a_new_file_has_the_usual_permissions_and_an_old_one_keeps_its_own) {
  const TemporaryFolder folder;
  const mode_t mask = ::umask(027);
  write_file_atomically(folder / "new", std::string_view("x"));
  ::umask(mask);
  EXPECT_EQ(mode_of(folder / "new"), 0640U);
  ::chmod((folder / "new").c_str(), 0755);
  write_file_atomically(folder / "new", std::string_view("y"));
  EXPECT_EQ(mode_of(folder / "new"), 0755U);
}

TEST(File, a_link_stays_a_link) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "store");
  write_file_atomically(folder / "store/a", std::string_view("old"));
  std::filesystem::create_symlink("store/a", folder / "link");
  write_file_atomically(folder / "link", std::string_view("new"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(text_of(folder / "store/a"), "new");
}

TEST(File, a_device_is_written_to_and_stays_what_it_is) {
  write_file_atomically("/dev/null", std::string_view("gone"));
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));

  const TemporaryFolder folder;
  const auto pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const pid_t reader = ::fork();
  if (reader == 0) {
    char text[8] = {};
    std::FILE* file = std::fopen(pipe.c_str(), "rb");
    const bool same = std::fread(text, 1, sizeof text, file) == 4 && std::string(text) == "sent";
    ::_exit(same ? 0 : 1);
  }
  write_file_atomically(pipe, std::string_view("sent"));
  int status = 1;
  ::waitpid(reader, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

TEST(File, a_full_disk_leaves_the_old_file_and_no_other) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a", std::string_view("old"));
  const pid_t child = ::fork();
  if (child == 0) {
    // A limit on the size of files stands in for a disk that is full.
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, 1000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    int status = 0;
    try {
      write_file_atomically(folder / "a", std::string(100000, 'x'));
    } catch (const Error& error) {
      status = static_cast<int>(error.kind());
    }
    ::_exit(status);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), static_cast<int>(ErrorKind::machine));
  EXPECT_EQ(text_of(folder / "a"), "old");
  EXPECT_THAT(files_in(folder.path()), testing::ElementsAre("a"));
}

TEST(File, one_file_under_two_names_is_no_place_for_input_and_output) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a", std::string_view("x"));
  write_file_atomically(folder / "b", std::string_view("x"));
  std::filesystem::create_symlink(folder / "a", folder / "link");
  std::filesystem::create_hard_link(folder / "a", folder / "hard");
  for (const char* same : {"a", "./a", "link", "hard"}) {
    const Error error = error_of([&] { require_different_files(folder / "a", folder / same); });
    EXPECT_EQ(error.kind(), ErrorKind::usage) << same;
  }
  EXPECT_NO_THROW(require_different_files(folder / "a", folder / "b"));
  EXPECT_NO_THROW(require_different_files(folder / "a", folder / "not yet there"));
}

TEST(File, hashes_are_those_of_xxh3_and_tell_contents_apart) {
  // The values that xxhsum 0.8 (-H3 and -H2) gives.
  EXPECT_EQ(checksum64({}), 0x2d06800538d394c2U);
  EXPECT_EQ(content_hash({}), "99aa06d3014798d86001c324468d497f");
  const std::string text = "kinespace";
  const auto bytes = std::as_bytes(std::span(text));
  EXPECT_NE(content_hash(bytes), content_hash(bytes.first(8)));
  EXPECT_EQ(content_hash(bytes).size(), 32U);
}

constexpr std::string_view some_bvh = "HIERARCHY\nROOT a\n";
constexpr std::string_view some_svg = "<svg xmlns='http://www.w3.org/2000/svg'/>";

TEST(File, a_file_is_put_over_its_own_kind_or_an_empty_one_only) {
  const TemporaryFolder folder;
  const auto path = folder / "a";
  write_file_atomically(path, std::string_view());
  write_file_atomically(path, some_bvh);
  const Error error = error_of([&] { write_file_atomically(path, some_svg); });
  EXPECT_EQ(error.kind(), ErrorKind::usage);
  EXPECT_THAT(error.what(), HasSubstr("a BVH motion of that name, expected no file, or an SVG picture"));
  EXPECT_EQ(text_of(path), some_bvh);
  write_file_atomically(path, std::string_view("HIERARCHY\nROOT b\n"));
  EXPECT_EQ(text_of(path), "HIERARCHY\nROOT b\n");
}

TEST(File, files_that_belong_together_are_all_there_or_none) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a.asf", std::string_view(":version 1.10\nold"));
  std::filesystem::create_directory(folder / "a.amc");  // nothing can be renamed over a folder
  const std::array files = {FileToWrite{folder / "a.asf", ":version 1.10\nnew"},
                            FileToWrite{folder / "a.amc", ":FULLY-SPECIFIED\nnew"},
                            FileToWrite{folder / "b.amc", ":FULLY-SPECIFIED\nnew"}};
  EXPECT_EQ(error_of([&] { write_files_atomically(files); }).kind(), ErrorKind::machine);
  EXPECT_EQ(text_of(folder / "a.asf"), ":version 1.10\nold");
  EXPECT_THAT(files_in(folder.path()), testing::UnorderedElementsAre("a.asf", "a.amc")) << "nothing else is left";
  std::filesystem::remove(folder / "a.amc");
  write_files_atomically(files);
  EXPECT_EQ(text_of(folder / "a.asf"), ":version 1.10\nnew");
  EXPECT_THAT(files_in(folder.path()), testing::UnorderedElementsAre("a.asf", "a.amc", "b.amc"));
}

// A file whose end is cut off while it is read: another thread does nothing else.
TEST(File, a_file_that_changes_its_length_while_it_is_read_is_an_error_or_is_read_whole) {
  const TemporaryFolder folder;
  const auto path = folder / "a";
  const std::string content(std::size_t{8} << 20, 'x');
  write_file_atomically(path, content);
  std::atomic<bool> stop{false};
  std::thread cutter([&] {
    for (std::uint64_t size = 0; !stop; size = (size + 4'093'082'899U) % content.size()) {
      ASSERT_EQ(::truncate(path.c_str(), static_cast<off_t>(size)), 0);
    }
  });
  int refused = 0;
  for (int i = 0; i < 2000 && refused < 3; ++i) {
    try {
      const FileContent read(path);
      for (const char c : read.text()) ASSERT_TRUE(c == 'x' || c == '\0');
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      EXPECT_THAT(error.what(), HasSubstr("stays as it is while it is read"));
      ++refused;
    }
  }
  stop = true;
  cutter.join();
  EXPECT_GT(refused, 0);
}

TEST(FileKind, is_told_by_how_a_file_begins) {
  const auto kind = [](std::string_view text) { return file_kind(std::as_bytes(std::span(text))); };
  EXPECT_EQ(kind(""), FileKind::empty);
  EXPECT_EQ(kind(std::string_view("SQLite format 3\0", 16)), FileKind::database);
  EXPECT_EQ(kind("\xef\xbb\xbf  hierarchy\n"), FileKind::bvh);
  EXPECT_EQ(kind("# made by hand\n:version 1.10"), FileKind::asf);
  EXPECT_EQ(kind(":FULLY-SPECIFIED\n"), FileKind::amc);
  EXPECT_EQ(kind("# frame\nv 1 2 3"), FileKind::obj);
  EXPECT_EQ(kind("{\"asset\": 1}"), FileKind::json);
  EXPECT_EQ(kind("<!doctype html>\n<html>"), FileKind::html);
  EXPECT_EQ(kind("#"), FileKind::other);
  EXPECT_EQ(kind("vertical lines"), FileKind::other);
}

}  // namespace
}  // namespace kinespace
