// A build that is killed (SIGKILL) at any of its changes to the disk: the old library stays, the imports that were
// committed stay.
#include <atomic>
#include <csignal>
#include <new>
#include <random>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "kinespace/base/error.h"
#include "kinespace/storage/library_build.h"
#include "tests/storage/disk_meter.h"
#include "tests/storage/sample_library.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

constexpr int imports = 150;
constexpr int clips = 150;

Bytes import_of(int number) {
  return Bytes(20'000, static_cast<std::byte>(number));
}

// What the child tells: how many imports it has committed. Lives in memory that both processes see.
class Shared {
 public:
  Shared()
      : memory_(::mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)),
        committed_(new (memory_) std::atomic<int>(0)) {}
  ~Shared() { ::munmap(memory_, sizeof(std::atomic<int>)); }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;
  std::atomic<int>& committed() { return *committed_; }

 private:
  void* memory_;
  std::atomic<int>* committed_;
};

void build(const std::filesystem::path& target, const char* fingerprint, std::atomic<int>& committed) {
  LibraryBuild build(target, {.fingerprint = fingerprint, .imports_per_commit = 5});
  for (int i = 0; i < imports; ++i) {
    const std::string key = std::to_string(i);
    if (build.find_import(key)) continue;
    build.keep_import(key, import_of(i));
    if (i % 5 == 4) {
      build.checkpoint();
      committed = i + 1;
    }
  }
  test::fill_sample(build.library(), clips, 3000);
  build.finish();
}

// A build that is killed at its so many-th change. Returns whether it had finished before.
bool killed_build(const std::filesystem::path& target, const char* fingerprint, std::int64_t change,
                  std::atomic<int>& committed) {
  const pid_t child = ::fork();
  if (child == 0) {
    try {
      test::die_at_change(change);
      build(target, fingerprint, committed);
    } catch (const Error& error) {
      std::fprintf(stderr, "%s\n", error.what());
      ::_exit(1);
    }
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0) << "the build failed by itself";
  return WIFEXITED(status);
}

class LibraryKill : public testing::Test {
 protected:
  LibraryKill() {
    LibraryBuild old(target_, {.fingerprint = "old"});
    test::fill_sample(old.library(), 3);
    old.finish();
  }

  test::TemporaryFolder folder_;
  std::filesystem::path target_ = folder_ / "a.kspace";
  Shared shared_;
};

TEST_F(LibraryKill, at_random_changes_leaves_the_old_library_or_the_new_one_and_imports_to_resume) {
  std::atomic<int>& committed = shared_.committed();
  const test::DiskMeter disk;
  build(folder_ / "whole.kspace", "whole", committed);
  const std::int64_t whole = disk.changes();

  std::mt19937 random(3);
  int kills = 0;
  int kills_with_imports = 0;
  std::string fingerprint;
  for (int round = 0; kills < 20 && round < 300; ++round) {
    committed = 0;
    // A fingerprint of its own every fifth round: from the start again, over what the last one left.
    fingerprint = "round " + std::to_string(round / 5);
    const auto change = std::uniform_int_distribution<std::int64_t>(1, whole)(random);
    const bool finished = killed_build(target_, fingerprint.c_str(), change, committed);
    kills += finished ? 0 : 1;

    const int found = test::expect_sample(Library::open_read_only(target_));
    EXPECT_TRUE(found == 3 || found == clips) << found;
    if (finished || found == clips) {
      // Start over from an old library of three clips.
      LibraryBuild old(target_, {.fingerprint = "old"});
      test::fill_sample(old.library(), 3);
      old.finish();
      continue;
    }
    LibraryBuild next(target_, {.fingerprint = fingerprint});
    EXPECT_GE(next.resumed_imports(), committed.load());
    for (int i = 0; i < committed; ++i) EXPECT_EQ(next.find_import(std::to_string(i)), import_of(i));
    kills_with_imports += next.resumed_imports() > 0 ? 1 : 0;
  }
  EXPECT_EQ(kills, 20);
  EXPECT_GE(kills_with_imports, 5) << "the changes did not fall into the build";

  build(target_, fingerprint.c_str(), committed);
  EXPECT_EQ(test::expect_sample(Library::open_read_only(target_)), clips);
  for (const char* ending : {".partial", ".partial-journal", ".new", ".new-journal", "-journal"}) {
    EXPECT_FALSE(std::filesystem::exists(target_.string() + ending)) << ending;
  }
}

}  // namespace
}  // namespace kinespace
