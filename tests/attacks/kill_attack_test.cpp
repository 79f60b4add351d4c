// Killed before any of the calls that change a file: every output is the old one or the new one.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/attacks/arena.h"

namespace kinespace::test {
namespace {

TEST(KillAttack, a_kill_before_any_change_of_a_file_leaves_every_output_whole) {
  Arena arena;
  for (const Work& work : arena.works()) {
    const long changes = arena.counts(work).changes;
    EXPECT_GT(changes, 2) << work.name;
    for (const long n : points_of(changes, 14)) {
      SCOPED_TRACE(fmt::format("{} killed before change {} of {}", work.name, n, changes));
      const auto outcome = arena.run(work, "exec env LD_PRELOAD=\"$FAILPOINT\" \"$@\"",
                                     {"FAILPOINT=" KINESPACE_FAILPOINT, fmt::format("KINESPACE_FAILPOINT=kill:{}", n)});
      arena.expect_whole(work, outcome, true);
    }
  }
}

}  // namespace
}  // namespace kinespace::test
