#include <png.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/mesh/picture.h"

namespace kinespace {

std::string format_png(const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  const auto fail = [&]() {
    const std::string why = image.message;
    png_image_free(&image);
    throw Error(ErrorKind::machine, {.found = "a picture cannot be written as PNG: " + why});
  };
  png_alloc_size_t size = 0;
  if (png_image_write_to_memory(&image, nullptr, &size, 0, picture.pixels.data(), 0, nullptr) == 0) fail();
  std::string out(size, '\0');
  if (png_image_write_to_memory(&image, out.data(), &size, 0, picture.pixels.data(), 0, nullptr) == 0) fail();
  out.resize(size);
  return out;
}

void write_png(const std::filesystem::path& path, const Picture& picture) {
  write_file_atomically(path, format_png(picture));
}

}  // namespace kinespace
