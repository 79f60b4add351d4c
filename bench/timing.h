// How long work takes.
#pragma once

#include <chrono>

namespace kinespace {

// On the wall.
template <typename Work>
double seconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace kinespace
