// libFuzzer's entry points for decoders of streams. The argument -codecs lists what KINESPACE_FUZZ_CODEC may be.
//
// The first byte of the input chooses what the rest is: a whole stream, or the content of one part of a good stream,
// under checksums that fit - or nothing would ever get past them.
#include "tests/fuzz/fuzz_target.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "kinespace/base/error.h"
#include "tests/support/forged_stream.h"

namespace kinespace::fuzz {
namespace {

const std::vector<std::string>& parts() {
  static const std::vector<std::string> all = test::parts_of(good_stream());
  return all;
}

void decode_or_error(std::span<const std::byte> bytes) {
  try {
    decode(bytes);
  } catch (const Error&) {
    // What a decoder owes hostile bytes.
  }
}

}  // namespace
}  // namespace kinespace::fuzz

std::string kinespace::fuzz::codec() {
  const char* const named = std::getenv("KINESPACE_FUZZ_CODEC");
  if (named != nullptr && *named != 0) return named;
  std::fputs("KINESPACE_FUZZ_CODEC names no codec; -codecs lists them\n", stderr);
  std::exit(2);
}

// Before any input is timed.
extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  if (*count == 2 && std::string((*arguments)[1]) == "-codecs") {
    for (const std::string& name : kinespace::fuzz::codecs()) std::printf("%s\n", name.c_str());
    std::exit(0);
  }
  static_cast<void>(kinespace::fuzz::parts());
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kinespace;
  if (size == 0) return 0;
  const auto input = std::as_bytes(std::span(data, size));
  const std::size_t choice = data[0] % (fuzz::parts().size() + 1);
  if (choice == fuzz::parts().size()) {
    fuzz::decode_or_error(input.subspan(1));
  } else {
    fuzz::decode_or_error(
        test::forged(fuzz::good_stream(), fuzz::parts()[choice], Bytes(input.begin() + 1, input.end())));
  }
  return 0;
}

// Starts from the good parts themselves: mutations of them go deeper than noise.
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  using namespace kinespace;
  if (size <= 1 && most > 1) {
    const Bytes& good = fuzz::good_stream();
    const std::size_t choice = seed % (fuzz::parts().size() + 1);
    const Bytes content = choice == fuzz::parts().size() ? good : test::part(good, fuzz::parts()[choice]);
    data[0] = static_cast<std::uint8_t>(choice);
    size = 1 + std::min(content.size(), most - 1);
    for (std::size_t i = 1; i < size; ++i) data[i] = static_cast<std::uint8_t>(content[i - 1]);
    return size;
  }
  return LLVMFuzzerMutate(data, size, most);
}
