// A small stream with every feature of the container. tests/storage/fixtures/bitstream_v1.ksm holds its bytes.
#pragma once

#include <string_view>
#include <vector>

#include "kinespace/storage/bitstream.h"

namespace kinespace::test {

inline Bytes to_bytes(std::string_view text) {
  const auto raw = std::as_bytes(std::span(text));
  return {raw.begin(), raw.end()};
}

inline std::vector<Bytes> sample_blocks() {
  return {to_bytes("the first function"), {}, to_bytes("the third"), Bytes(200, std::byte{0x5a})};
}

inline Bytes sample_stream() {
  BitstreamWriter writer("clip-vectors");
  writer.set_option("name", "a \"walk\": it's 1\n");
  writer.set_option("functions", std::int64_t{3});
  writer.set_option("rate", 29.97);
  writer.set_error({.mean_joint_error_cm = 0.25, .shell_error_cm = 1.5});
  writer.add_section("head", to_bytes("header of the clip"));
  writer.add_progressive_section("scores", sample_blocks());
  writer.add_section("empty", {});
  return writer.finish();
}

}  // namespace kinespace::test
