#include "kinespace/repeats/frame_table.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

[[noreturn]] void reject(std::string found, std::string expected) {
  throw Error(ErrorKind::usage, {.found = std::move(found), .expected = std::move(expected)});
}

}  // namespace

void FrameTable::validate() const {
  if (!(rate_hz > 0) || !std::isfinite(rate_hz)) reject("a frame table of " + std::to_string(rate_hz) + " Hz", "> 0");
  if (dimensions < 1 || frames < 1) reject("an empty frame table", "at least one frame of one number");
  if (values.size() != static_cast<std::size_t>(frames) * static_cast<std::size_t>(dimensions)) {
    reject(std::to_string(values.size()) + " numbers in a frame table", "frames x dimensions");
  }
  const bool ascending = std::is_sorted(starts.begin(), starts.end(), std::less_equal<>());
  if (starts.empty() || starts.front() != 0 || !ascending || starts.back() >= frames) {
    reject("starts of clips in a frame table", "0 first, ascending, below the number of frames");
  }
  const auto bad = std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
  if (bad == values.end()) return;
  throw Error(ErrorKind::bad_input, {.found = "a number that is not finite in frame " +
                                              std::to_string((bad - values.begin()) / dimensions) + " of the table",
                                     .expected = "finite numbers"});
}

}  // namespace kinespace
