// A libFuzzer target for one codec's decoder, KINESPACE_FUZZ_CODEC.
//
// The first byte of the input chooses what the rest is: a whole stream, or the content of one part of a good stream,
// under checksums that fit - or nothing would ever get past them.
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "codecs/registry.h"
#include "examples/sample_motions.h"
#include "tests/codecs/forged_stream.h"

namespace kinespace {
namespace {

const Bytes& good_stream() {
  static const Bytes stream = [] {
    std::vector<Clip> clips;
    const auto motions = sample_library({.takes = 1});
    for (const auto& motion : std::span(motions).first(3)) clips.push_back(slice(motion.clip, 0, 40));
    return encode(KINESPACE_FUZZ_CODEC, clips);
  }();
  return stream;
}

void decode(std::span<const std::byte> bytes) {
  try {
    const auto reader = open_stream(bytes, "fuzzed");
    for (std::size_t c = 0; c < reader->clips().size() && c < 8; ++c) static_cast<void>(reader->decode(c));
  } catch (const Error&) {
    // What a decoder owes hostile bytes.
  }
}

}  // namespace
}  // namespace kinespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kinespace;
  if (size == 0) return 0;
  const auto input = std::as_bytes(std::span(data, size));
  static const std::vector<std::string> parts = test::parts_of(good_stream());
  const std::size_t choice = data[0] % (parts.size() + 1);
  if (choice == parts.size()) {
    decode(input.subspan(1));
  } else {
    decode(test::forged(good_stream(), parts[choice], Bytes(input.begin() + 1, input.end())));
  }
  return 0;
}

// Starts from the good parts themselves: mutations of them go deeper than noise.
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  using namespace kinespace;
  if (size <= 1 && most > 1) {
    const auto parts = test::parts_of(good_stream());
    const std::size_t choice = seed % (parts.size() + 1);
    const Bytes content = choice == parts.size() ? good_stream() : test::part(good_stream(), parts[choice]);
    data[0] = static_cast<std::uint8_t>(choice);
    size = 1 + std::min(content.size(), most - 1);
    for (std::size_t i = 1; i < size; ++i) data[i] = static_cast<std::uint8_t>(content[i - 1]);
    return size;
  }
  return LLVMFuzzerMutate(data, size, most);
}
