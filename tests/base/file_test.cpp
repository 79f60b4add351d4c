#include "base/file.h"

#include <csignal>
#include <functional>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/error.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::TemporaryFolder;
using testing::HasSubstr;

Error error_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return {ErrorKind::usage, {}};
}

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
  return std::string(MappedFile(path).text());
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

TEST(File, a_view_outlives_a_move_and_the_replacing_of_its_file) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a", std::string_view("old"));
  MappedFile file(folder / "a");
  write_file_atomically(folder / "a", std::string_view("new, longer"));
  MappedFile moved = std::move(file);
  EXPECT_EQ(moved.text(), "old");
  moved = MappedFile(folder / "a");
  EXPECT_EQ(moved.text(), "new, longer");
  EXPECT_EQ(moved.bytes().size(), 11U);
}

TEST(File, what_cannot_be_read_is_bad_input_with_its_name) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (const char* name : {"missing", "pipe", "."}) {
    const Error error = error_of([&] { MappedFile file(folder / name); });
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

}  // namespace
}  // namespace kinespace
