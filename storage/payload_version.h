// The version of what a codec puts into a bitstream: a list of each codec, oldest first and append-only, with the reason for
// each. A stream names it in the option "payload"; streams of version 1, which are older than the option, have none.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "kinespace/storage/bitstream.h"

namespace kinespace {

struct PayloadVersion {
  int number = 1;
  std::string_view reason;
};

// Of a codec that has changed nothing yet.
inline constexpr std::array first_payload{PayloadVersion{1, "as it was first written"}};

// The version that a stream is of. Throws Error{bad_input} when it is none of the list.
[[nodiscard]] int payload_version(const Bitstream& stream, std::span<const PayloadVersion> known);

}  // namespace kinespace
