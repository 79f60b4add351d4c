// Buffer views packed by EXT_meshopt_compression. For gltf/document.cpp only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "kinespace/gltf/budget.h"

namespace kinespace::gltf {

// The members of the extension's object, whose names these are.
struct PackedView {
  std::size_t view = 0;  // the view that it stands for
  int buffer = -1;
  std::uint64_t offset = 0, length = 0, stride = 0, count = 0;
  std::string mode;    // ATTRIBUTES, TRIANGLES or INDICES
  std::string filter;  // none, NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL
};

// The count * stride bytes that are packed in `buffer`. Throws Error{bad_input} where they are not, or the extension does
// not allow for what is said of them.
[[nodiscard]] std::vector<unsigned char> unpacked(const PackedView& packed, const std::vector<unsigned char>& buffer,
                                                  const std::string& file, Budget& budget);

}  // namespace kinespace::gltf
