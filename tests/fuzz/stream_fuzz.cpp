// A libFuzzer target for one clip codec's decoder, KINESPACE_FUZZ_CODEC.
#include <algorithm>
#include <vector>

#include "examples/sample_motions.h"
#include "kinespace/codecs/registry.h"
#include "tests/fuzz/fuzz_target.h"

namespace kinespace::fuzz {

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
  const auto reader = open_stream(bytes, "fuzzed");
  for (std::size_t c = 0; c < reader->clips().size() && c < 8; ++c) static_cast<void>(reader->decode(c));
}

}  // namespace kinespace::fuzz
