// Counts what operator new hands out, so that a test can hold code to its memory.
#pragma once

#include <cstddef>

namespace kinespace::test {

class AllocationMeter {
 public:
  // Starts counting from here. One at a time.
  AllocationMeter();
  // The most bytes in use at once since then, beyond those in use at the start.
  [[nodiscard]] std::size_t peak_bytes() const;

 private:
  std::size_t start_;
};

}  // namespace kinespace::test
