// Closed or full standard descriptors: the work goes on, and the exit code tells whether its result arrived.
#include <string_view>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/attacks/arena.h"

namespace kinespace::test {
namespace {

TEST(DescriptorAttack, closed_and_full_descriptors_do_not_end_the_work) {
  Arena arena;
  for (const Work& work : arena.works()) {
    for (const char* redirection : {"<&-", ">&-", "2>&-", "<&- >&-", "<&- 2>&-", ">&- 2>&-", "<&- >&- 2>&-",
                                    "2>/dev/full", ">/dev/full", ">/dev/full 2>/dev/full", ">/dev/full 2>&-"}) {
      SCOPED_TRACE(fmt::format("{} {}", work.name, redirection));
      const auto outcome = arena.run(work, fmt::format("exec \"$@\" {}", redirection));
      // Conversions print no result.
      const bool prints = !work.name.starts_with("convert");
      const std::string_view how(redirection);
      const bool lost = how.find("2>") != 0 && (how.starts_with(">") || how.find(" >") != std::string_view::npos);
      EXPECT_EQ(outcome.result.signal, 0);
      EXPECT_EQ(outcome.result.code, prints && lost ? 3 : 0) << outcome.result.err;
      arena.expect_done(work, outcome);
    }
  }
}

}  // namespace
}  // namespace kinespace::test
