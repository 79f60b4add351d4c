#include "kinespace/base/progress.h"

#include <string>

#include <gtest/gtest.h>

namespace kinespace {
namespace {

TEST(Progress, by_default_is_silent_and_never_stops) {
  const Progress progress;
  EXPECT_NO_THROW(progress.at("import", 0.5));
  EXPECT_NO_THROW(progress.check_stop());
}

TEST(Progress, tells_and_stops_when_asked_to) {
  std::string told;
  bool stop = false;
  const Progress progress{.report = [&told](std::string_view stage, double) { told = stage; },
                          .stop_requested = [&stop] { return stop; }};
  progress.at("import", 0.5);
  EXPECT_EQ(told, "import");
  EXPECT_NO_THROW(progress.check_stop());
  stop = true;
  EXPECT_THROW(progress.check_stop(), Interrupted);
}

}  // namespace
}  // namespace kinespace
