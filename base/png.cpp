#include "kinespace/base/png.h"

#include <png.h>

#include "kinespace/base/error.h"

namespace kinespace {

std::string format_png(int width, int height, std::span<const std::uint8_t> pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  std::string out(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t bytes = out.size();
  if (png_image_write_to_memory(&image, out.data(), &bytes, 0, pixels.data(), 0, nullptr) == 0) {
    const std::string why = image.message;
    png_image_free(&image);
    throw Error(ErrorKind::machine, {.found = "a picture cannot be written as PNG: " + why});
  }
  out.resize(bytes);
  return out;
}

}  // namespace kinespace
