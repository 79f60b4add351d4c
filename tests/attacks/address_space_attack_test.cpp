// Less and less address space: done, or a message; never a crash, and never work without end.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/attacks/arena.h"

namespace kinespace::test {
namespace {

TEST(AddressSpaceAttack, a_limit_on_memory_ends_in_a_result_or_a_message) {
  Arena arena;
  for (const Work& work : arena.works()) {
    for (const int megabytes : {100, 150, 200, 300, 450, 700, 1100}) {
      SCOPED_TRACE(fmt::format("{} in {} MB", work.name, megabytes));
      // Processor time is limited so that work without end is a signal and not a test that hangs: what needs a second
      // gets two minutes.
      const auto outcome = arena.run(work, fmt::format("ulimit -t 120; ulimit -v {}; exec \"$@\"", megabytes * 1024));
      if (outcome.result.code == 127) continue;  // not enough to load the program
      arena.expect_whole(work, outcome);
    }
  }
}

}  // namespace
}  // namespace kinespace::test
