// Pictures as PNG files.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace kinespace {

// An RGB picture, three bytes a pixel, row by row from the top. Throws Error{machine} when it cannot be made.
[[nodiscard]] std::string format_png(int width, int height, std::span<const std::uint8_t> pixels);

}  // namespace kinespace
