// Memory that is needed no more before its owner goes.
#pragma once

#include <span>

namespace kinespace {

// Gives the whole pages that lie within `values` back to the system. What stood there is lost, which of it is not said:
// for an owner that is about to go, and whose place is needed at once.
void discard_pages(std::span<double> values) noexcept;

}  // namespace kinespace
