// Work on all processors: a loop whose steps do not depend on each other.
//
// The one place where the library starts parallel loops. oneTBB's own loop, called inside another that has just failed
// elsewhere, returns as if it had been done and leaves steps out; its caller would go on with values that were never
// made. Here such a loop throws instead.
#pragma once

#include <concepts>
#include <cstdint>
#include <memory>

namespace kinespace {

// Thrown by a loop inside of another one that has failed: ends the step that called it. The outer loop throws what
// failed first, so nobody outside of a loop meets this.
struct LoopCancelled {};

namespace parallel_internal {
// Calls steps(body, begin, end) for parts that cover first to last.
void run(std::int64_t first, std::int64_t last, const void* body,
         void (*steps)(const void* body, std::int64_t begin, std::int64_t end));
}  // namespace parallel_internal

// body(i) for first <= i < last, each once, in any order and at the same time. Throws what the first step that failed
// threw; steps that have not begun by then are left out.
template <std::integral Index, typename Body>
void parallel_for(Index first, Index last, const Body& body) {
  parallel_internal::run(static_cast<std::int64_t>(first), static_cast<std::int64_t>(last), std::addressof(body),
                         [](const void* of, std::int64_t begin, std::int64_t end) {
                           const Body& step = *static_cast<const Body*>(of);
                           for (std::int64_t i = begin; i < end; ++i) step(static_cast<Index>(i));
                         });
}

}  // namespace kinespace
