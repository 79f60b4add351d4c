// A libFuzzer target for the decoders of clips: every codec of the registry.
#include <algorithm>
#include <vector>

#include "examples/sample_motions.h"
#include "kinespace/codecs/registry.h"
#include "tests/fuzz/fuzz_target.h"

namespace kinespace::fuzz {

std::vector<std::string> codecs() {
  std::vector<std::string> out;
  for (const Codec* codec : all_codecs()) out.emplace_back(codec->name());
  return out;
}

const Bytes& good_stream() {
  static const Bytes stream = [] {
    std::vector<Clip> clips;
    const auto motions = sample_library({.takes = 1});
    for (const auto& motion : std::span(motions).first(3)) clips.push_back(slice(motion.clip, 0, 40));
    return encode(codec(), clips);
  }();
  return stream;
}

void decode(std::span<const std::byte> bytes) {
  const auto reader = open_stream(bytes, "fuzzed");
  for (std::size_t c = 0; c < reader->clips().size() && c < 8; ++c) static_cast<void>(reader->decode(c));
}

}  // namespace kinespace::fuzz
