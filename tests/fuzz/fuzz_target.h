// What a fuzz target tells fuzz_target.cpp: the codecs there are, a good stream to start from, and how streams are decoded.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"

namespace kinespace::fuzz {

[[nodiscard]] std::vector<std::string> codecs();
// By the codec that the environment names, KINESPACE_FUZZ_CODEC.
[[nodiscard]] std::string codec();
[[nodiscard]] const Bytes& good_stream();
// An Error is what a decoder owes hostile bytes; anything else that leaves it is a finding.
void decode(std::span<const std::byte> bytes);

}  // namespace kinespace::fuzz
