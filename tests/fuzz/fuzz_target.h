// What a fuzz target tells fuzz_target.cpp: a good stream to start from, and how streams are decoded.
#pragma once

#include <cstddef>
#include <span>

#include "kinespace/base/bytes.h"

namespace kinespace::fuzz {

[[nodiscard]] const Bytes& good_stream();
// An Error is what a decoder owes hostile bytes; anything else that leaves it is a finding.
void decode(std::span<const std::byte> bytes);

}  // namespace kinespace::fuzz
