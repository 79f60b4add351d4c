// The frames of many clips as rows of numbers, one after another: what the repeated motion analysis works on.
//
// Usually marker positions in cm in the frame of the root (markers.h). Frames of different clips stand side by side but
// have nothing to do with each other: no segment, path or clip of the analysis runs across a start.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kinespace {

struct FrameTable {
  double rate_hz = 0;                // frames per second, the same for all clips
  int dimensions = 0;                // numbers a frame
  std::int64_t frames = 0;           // of all clips together
  std::vector<float> values;         // [frame][dimension], finite
  std::vector<std::int64_t> starts;  // the first frame of every clip, ascending, starts[0] == 0

  [[nodiscard]] std::span<const float> frame(std::int64_t index) const {
    return std::span(values).subspan(static_cast<std::size_t>(index * dimensions),
                                     static_cast<std::size_t>(dimensions));
  }
  // Throws Error{usage} when sizes, starts or the rate do not fit together, Error{bad_input} when a value is not
  // finite.
  void validate() const;
};

// Frames first to last - 1.
struct FrameSpan {
  std::int64_t first = 0;
  std::int64_t last = 0;  // exclusive
  [[nodiscard]] std::int64_t frames() const { return last - first; }
  bool operator==(const FrameSpan&) const = default;
};

}  // namespace kinespace
