// Streams with one part replaced, under checksums that fit: what the checks behind the checksums must stop.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kinespace/storage/bitstream.h"

namespace kinespace::test {

// The parts of a stream that can be replaced: plain sections, and the first block of progressive ones.
[[nodiscard]] inline std::vector<std::string> parts_of(const Bytes& stream) {
  return Bitstream::parse(stream, "s").section_names();
}

[[nodiscard]] inline Bytes part(const Bytes& stream, const std::string& name) {
  const Bitstream parsed = Bitstream::parse(stream, "s");
  if (!parsed.is_progressive(name)) {
    const auto bytes = parsed.section(name);
    return {bytes.begin(), bytes.end()};
  }
  const auto blocks = parsed.blocks(name);
  return blocks.empty() ? Bytes() : Bytes(blocks.front().begin(), blocks.front().end());
}

// `name`: of the part that becomes `content`; empty: a copy. `options`: beside, or instead of, those that it has.
[[nodiscard]] inline Bytes forged(const Bytes& stream, std::string_view name, const Bytes& content,
                                  const BitstreamOptions& options = {}) {
  const Bitstream parsed = Bitstream::parse(stream, "s");
  BitstreamWriter out(parsed.kind());
  out.set_error(parsed.error());
  for (const auto& [key, value] : parsed.options()) out.set_option(key, value);
  for (const auto& [key, value] : options) out.set_option(key, value);
  for (const std::string& section : parsed.section_names()) {
    if (!parsed.is_progressive(section)) {
      const auto bytes = parsed.section(section);
      out.add_section(section, section == name ? content : Bytes(bytes.begin(), bytes.end()));
      continue;
    }
    std::vector<Bytes> blocks;
    for (const auto block : parsed.blocks(section)) blocks.emplace_back(block.begin(), block.end());
    if (section == name && !blocks.empty()) blocks.front() = content;
    out.add_progressive_section(section, blocks);
  }
  return out.finish();
}

[[nodiscard]] inline Bytes with_option(const Bytes& stream, const std::string& key, const std::string& value) {
  return forged(stream, {}, {}, {{key, value}});
}

}  // namespace kinespace::test
