// A disk that takes no more, at any of the calls that change a file, and really full.
#include <cstdlib>
#include <filesystem>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>

#include "tests/attacks/arena.h"

namespace kinespace::test {
namespace {

TEST(DiskAttack, a_change_of_a_file_that_fails_leaves_every_output_whole) {
  Arena arena;
  for (const Work& work : arena.works()) {
    const long changes = arena.counts(work).changes;
    for (const long n : points_of(changes, 14)) {
      SCOPED_TRACE(fmt::format("{}: change {} of {} fails", work.name, n, changes));
      const auto outcome = arena.run(work, "exec env LD_PRELOAD=\"$FAILPOINT\" \"$@\"",
                                     {"FAILPOINT=" KINESPACE_FAILPOINT, fmt::format("KINESPACE_FAILPOINT=disk:{}", n)});
      arena.expect_whole(work, outcome);
    }
  }
}

// The file system of this test alone, of 16 MB, so that it can be filled up. False where we may not mount one.
bool mount_small(const std::filesystem::path& folder) {
  return ::unshare(CLONE_NEWNS) == 0 && ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         ::mount("none", folder.c_str(), "tmpfs", 0, "size=16m") == 0;
}

// Who may not mount limits the length of files instead, which ends writing at the same places.
TEST(DiskAttack, a_full_disk_is_told_and_leaves_every_output_whole) {
  const TemporaryFolder small;
  const bool mounted = mount_small(small.path());
  ASSERT_EQ(::setenv("TMPDIR", small.path().c_str(), 1), 0);
  Arena arena;
  ASSERT_EQ(::unsetenv("TMPDIR"), 0);
  for (const Work& work : arena.works()) {
    for (const int kilobytes : {0, 1, 4, 16, 64}) {
      SCOPED_TRACE(fmt::format("{} with {} kB left", work.name, kilobytes));
      const std::string shell =
          mounted ? fmt::format(
                        "head -c $(($(df --output=avail -B1024 . | tail -n 1) - {}))k /dev/zero >../filler; "
                        "\"$@\"; code=$?; rm ../filler; exit $code",
                        kilobytes)
                  : fmt::format("ulimit -f {}; exec \"$@\"", kilobytes);
      arena.expect_whole(work, arena.run(work, shell));
    }
  }
  if (mounted) ::umount2(small.path().c_str(), MNT_DETACH);
}

}  // namespace
}  // namespace kinespace::test
