// Any one allocation fails: the work is done all the same, or ends with a message and leaves everything as it was.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/attacks/arena.h"

namespace kinespace::test {
namespace {

TEST(MemoryAttack, an_allocation_that_fails_ends_the_work_with_a_message_and_harms_no_file) {
  Arena arena;
  for (const Work& work : arena.works()) {
    const long allocations = arena.counts(work).allocations;
    EXPECT_GT(allocations, 100) << work.name;
    for (const long n : points_of(allocations, 40)) {
      SCOPED_TRACE(fmt::format("{}: allocation {} of {} fails", work.name, n, allocations));
      const auto outcome =
          arena.run(work, "exec env LD_PRELOAD=\"$FAILPOINT\" \"$@\"",
                    {"FAILPOINT=" KINESPACE_FAILPOINT, fmt::format("KINESPACE_FAILPOINT=alloc:{}", n)});
      arena.expect_whole(work, outcome);
    }
  }
}

}  // namespace
}  // namespace kinespace::test
