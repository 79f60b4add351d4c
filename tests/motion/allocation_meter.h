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
  // All that were handed out since then, given back or not, and in how many pieces.
  [[nodiscard]] std::size_t all_bytes() const;
  [[nodiscard]] std::size_t pieces() const;

 private:
  std::size_t start_;
  std::size_t start_bytes_;
  std::size_t start_pieces_;
};

}  // namespace kinespace::test
