// How much memory a piece of work holds at most, and takes in all: the heap's, by counting every malloc of the process.
// Under a sanitizer, which brings its own heap, nothing is counted and `counts()` is false.
#pragma once

#include <cstddef>

namespace kinespace::test {

class AllocationMeter {
 public:
  AllocationMeter();  // starts at what is held now
  [[nodiscard]] static bool counts();
  // The most that was held at once since, beyond what was held at the start, in bytes.
  [[nodiscard]] std::size_t peak() const;
  // All that was handed out since, given back or not, and in how many pieces.
  [[nodiscard]] std::size_t all_bytes() const;
  [[nodiscard]] std::size_t pieces() const;

 private:
  std::size_t start_, start_bytes_, start_pieces_;
};

}  // namespace kinespace::test
