#include "kinespace/storage/payload_version.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {

int payload_version(const Bitstream& stream, std::span<const PayloadVersion> known) {
  const bool told = stream.find_option("payload") != nullptr;
  const auto number = static_cast<int>(told ? stream.integer_option("payload", 1, std::numeric_limits<int>::max()) : 1);
  if (std::ranges::find(known, number, &PayloadVersion::number) == known.end()) {
    throw Error(ErrorKind::bad_input, {.file = stream.source(),
                                       .found = fmt::format("{} of payload version {}", stream.kind(), number),
                                       .expected = fmt::format("version {} at most", known.back().number),
                                       .remedy = "read it with a newer kinespace"});
  }
  return number;
}

}  // namespace kinespace
