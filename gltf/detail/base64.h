// RFC 4648, section 4: what a data: URI is made of.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace kinespace::gltf {

// Nothing for a text with other characters, or cut within a byte. The padding may be missing.
[[nodiscard]] std::optional<std::vector<unsigned char>> decode_base64(std::string_view text);

}  // namespace kinespace::gltf
