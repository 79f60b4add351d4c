#include "kinespace/gltf/budget.h"

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace::gltf {

void Budget::take(std::string_view what, std::uint64_t count, std::uint64_t size) {
  const std::uint64_t left = most() > taken_ ? most() - taken_ : 0;
  if (size == 0 || count <= left / size) {
    taken_ += count * size;
    return;
  }
  const double megabyte = 1e6;
  const double wanted = static_cast<double>(taken_) + static_cast<double>(count) * static_cast<double>(size);
  throw Error(
      ErrorKind::bad_input,
      {.file = file_,
       .found = fmt::format("{} that take {:.0f} MB with what is read already", what, wanted / megabyte),
       .expected = fmt::format("at most {:.0f} MB from a file of its size", static_cast<double>(most()) / megabyte),
       .remedy = remedy_});
}

}  // namespace kinespace::gltf
