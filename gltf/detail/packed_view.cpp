#include "kinespace/gltf/detail/packed_view.h"

#include <span>

#include <fmt/format.h>
#include <meshoptimizer.h>

#include "kinespace/base/error.h"

namespace kinespace::gltf {
namespace {

[[noreturn]] void fail_packed(const PackedView& packed, const std::string& file, const std::string& found,
                              std::string expected) {
  throw Error(ErrorKind::bad_input, {.file = file,
                                     .found = fmt::format("{} in bufferView {}, which is packed", found, packed.view),
                                     .expected = std::move(expected),
                                     .remedy = "save it without EXT_meshopt_compression"});
}

// What the decoders take for granted.
void require_sizes(const PackedView& packed, const std::string& file) {
  const bool attributes = packed.mode == "ATTRIBUTES";
  if (!attributes && packed.mode != "TRIANGLES" && packed.mode != "INDICES") {
    fail_packed(packed, file, "mode \"" + packed.mode.substr(0, 20) + "\"", "ATTRIBUTES, TRIANGLES or INDICES");
  }
  const bool fits = attributes ? packed.stride >= 4 && packed.stride <= 256 && packed.stride % 4 == 0
                               : packed.stride == 2 || packed.stride == 4;
  if (!fits) {
    fail_packed(packed, file, fmt::format("a stride of {}", packed.stride),
                attributes ? "a multiple of 4, 256 at most" : "2 or 4");
  }
  if (packed.mode == "TRIANGLES" && packed.count % 3 != 0) {
    fail_packed(packed, file, fmt::format("{} corners of triangles", packed.count), "three a triangle");
  }
}

using Decoder = int (*)(void* to, std::size_t count, std::size_t stride, const unsigned char* from, std::size_t bytes);

Decoder decoder_of(const std::string& mode) {
  if (mode == "TRIANGLES") return meshopt_decodeIndexBuffer;
  if (mode == "INDICES") return meshopt_decodeIndexSequence;
  return meshopt_decodeVertexBuffer;
}

void apply_filter(const PackedView& packed, const std::string& file, std::vector<unsigned char>& bytes) {
  if (packed.filter.empty() || packed.filter == "NONE") return;
  const auto require_stride = [&](bool fits, const char* expected) {
    if (!fits || packed.mode != "ATTRIBUTES") {
      fail_packed(packed, file, fmt::format("filter {} at a stride of {}", packed.filter, packed.stride), expected);
    }
  };
  if (packed.filter == "OCTAHEDRAL") {
    require_stride(packed.stride == 4 || packed.stride == 8, "attributes of 4 or 8 bytes");
    meshopt_decodeFilterOct(bytes.data(), packed.count, packed.stride);
  } else if (packed.filter == "QUATERNION") {
    require_stride(packed.stride == 8, "attributes of 8 bytes");
    meshopt_decodeFilterQuat(bytes.data(), packed.count, packed.stride);
  } else if (packed.filter == "EXPONENTIAL") {
    require_stride(true, "attributes");
    meshopt_decodeFilterExp(bytes.data(), packed.count, packed.stride);
  } else {
    fail_packed(packed, file, "filter \"" + packed.filter.substr(0, 20) + "\"",
                "NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL");
  }
}

}  // namespace

std::vector<unsigned char> unpacked(const PackedView& packed, const std::vector<unsigned char>& buffer,
                                    const std::string& file, Budget& budget) {
  require_sizes(packed, file);
  if (packed.offset > buffer.size() || packed.length > buffer.size() - packed.offset) {
    fail_packed(packed, file, fmt::format("{} bytes from {}", packed.length, packed.offset),
                fmt::format("bytes of its buffer, which has {}", buffer.size()));
  }
  budget.take("what EXT_meshopt_compression packs", packed.count, packed.stride);
  std::vector<unsigned char> out(packed.count * packed.stride);
  const std::span<const unsigned char> from = std::span(buffer).subspan(packed.offset, packed.length);
  if (packed.count > 0) {
    if (decoder_of(packed.mode)(out.data(), packed.count, packed.stride, from.data(), from.size()) != 0) {
      fail_packed(packed, file, "damage", "bytes as EXT_meshopt_compression has them");
    }
    apply_filter(packed, file, out);
  }
  return out;
}

}  // namespace kinespace::gltf
