#include "mesh/gltf_accessors.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

#include <fmt/format.h>
#include <tiny_gltf.h>

#include "base/error.h"

namespace kinespace {
namespace {

// 0 for what is no component type.
std::size_t component_size(int component) {
  switch (component) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;
  }
}

template <typename T>
T raw(const unsigned char* at) {
  T out;
  std::memcpy(&out, at, sizeof out);
  return out;
}

double component_at(const unsigned char* at, int component, bool normalised) {
  const auto scaled = [&](double value, double largest) {
    return normalised ? std::max(value / largest, -1.0) : value;
  };
  switch (component) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return scaled(raw<std::int8_t>(at), 127);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return scaled(raw<std::uint8_t>(at), 255);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return scaled(raw<std::int16_t>(at), 32767);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return scaled(raw<std::uint16_t>(at), 65535);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return raw<std::uint32_t>(at);
    default:
      return static_cast<double>(raw<float>(at));
  }
}

int width_of(int type) {
  switch (type) {
    case TINYGLTF_TYPE_SCALAR:
      return 1;
    case TINYGLTF_TYPE_VEC2:
      return 2;
    case TINYGLTF_TYPE_VEC3:
      return 3;
    case TINYGLTF_TYPE_VEC4:
      return 4;
    case TINYGLTF_TYPE_MAT4:
      return 16;
    default:
      return 0;
  }
}

}  // namespace

GltfAccessors::GltfAccessors(const tinygltf::Model& model, std::string file) : model_(model), file_(std::move(file)) {
  for (const tinygltf::Accessor& a : model_.accessors) {
    const std::size_t size = component_size(a.componentType);
    if (a.bufferView < 0 || size == 0 || width_of(a.type) == 0) continue;
    (void)view_of(a.bufferView, a.byteOffset, a.count, a.componentType, width_of(a.type));
    most_count_ = std::max(most_count_, a.count);
  }
}

void GltfAccessors::fail(std::string found, std::string expected, std::string remedy) const {
  throw Error(ErrorKind::bad_input,
              {.file = file_, .found = std::move(found), .expected = std::move(expected), .remedy = std::move(remedy)});
}

GltfAccessors::View GltfAccessors::view_of(int buffer_view, std::size_t offset, std::size_t count, int component,
                                           int width) const {
  if (buffer_view < 0 || static_cast<std::size_t>(buffer_view) >= model_.bufferViews.size()) {
    fail(fmt::format("bufferView {}", buffer_view), fmt::format("fewer than {}", model_.bufferViews.size()));
  }
  const tinygltf::BufferView& view = model_.bufferViews[static_cast<std::size_t>(buffer_view)];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model_.buffers.size()) {
    fail(fmt::format("buffer {}", view.buffer), fmt::format("fewer than {}", model_.buffers.size()));
  }
  const auto& data = model_.buffers[static_cast<std::size_t>(view.buffer)].data;
  const std::size_t size = component_size(component) * static_cast<std::size_t>(width);
  const std::size_t stride = view.byteStride == 0 ? size : view.byteStride;
  if (size == 0 || view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset) {
    fail(fmt::format("bufferView {} beyond its buffer", buffer_view), fmt::format("{} bytes at most", data.size()));
  }
  const bool fits = count == 0 || (offset <= view.byteLength && size <= view.byteLength - offset &&
                                   count - 1 <= (view.byteLength - offset - size) / stride);
  if (!fits) fail(fmt::format("{} elements in bufferView {}", count, buffer_view), "as many as it has bytes for");
  if (count == 0) return {data.data(), stride, 0, component};
  return {data.data() + view.byteOffset + offset, stride, count, component};
}

std::size_t GltfAccessors::count_of(int accessor, int width) const {
  if (accessor < 0 || static_cast<std::size_t>(accessor) >= model_.accessors.size()) {
    fail(fmt::format("accessor {}", accessor), fmt::format("fewer than {}", model_.accessors.size()));
  }
  const tinygltf::Accessor& a = model_.accessors[static_cast<std::size_t>(accessor)];
  if (width_of(a.type) != width || component_size(a.componentType) == 0) {
    fail(fmt::format("accessor {} of another type", accessor), fmt::format("elements of {} numbers", width));
  }
  if (a.bufferView < 0 && a.count > most_count_) {
    fail(fmt::format("accessor {} with {} elements and no data", accessor, a.count),
         fmt::format("at most {}", most_count_));
  }
  return a.count;
}

template <typename T>
void GltfAccessors::read(int accessor, int width, std::vector<T>& out) const {
  const std::size_t count = count_of(accessor, width);
  const tinygltf::Accessor& a = model_.accessors[static_cast<std::size_t>(accessor)];
  const auto components = static_cast<std::size_t>(width);
  const std::size_t size = component_size(a.componentType);
  const auto copy = [&](const View& from, std::size_t element, std::size_t to) {
    for (std::size_t c = 0; c < components; ++c) {
      const double value = component_at(from.data + element * from.stride + c * size, from.component, a.normalized);
      out[to * components + c] = static_cast<T>(std::is_integral_v<T> ? std::clamp(value, 0.0, 4294967295.0) : value);
    }
  };
  if (a.bufferView >= 0) {
    const View view = view_of(a.bufferView, a.byteOffset, count, a.componentType, width);
    out.resize(count * components);
    for (std::size_t i = 0; i < count; ++i) copy(view, i, i);
  } else {
    out.assign(count * components, T{});
  }
  if (!a.sparse.isSparse) return;
  if (a.sparse.count < 0) fail(fmt::format("accessor {} with a negative count", accessor), "0 or more");
  const auto changed = static_cast<std::size_t>(a.sparse.count);
  const View at = view_of(a.sparse.indices.bufferView, static_cast<std::size_t>(a.sparse.indices.byteOffset), changed,
                          a.sparse.indices.componentType, 1);
  const View values = view_of(a.sparse.values.bufferView, static_cast<std::size_t>(a.sparse.values.byteOffset), changed,
                              a.componentType, width);
  for (std::size_t i = 0; i < changed; ++i) {
    const double index = component_at(at.data + i * at.stride, at.component, false);
    if (!(index >= 0 && index < static_cast<double>(count))) {
      fail(fmt::format("sparse index {} of accessor {}", index, accessor), fmt::format("below {}", count));
    }
    copy(values, i, static_cast<std::size_t>(index));
  }
}

std::vector<float> GltfAccessors::floats(int accessor, int width) const {
  std::vector<float> out;
  read(accessor, width, out);
  return out;
}

std::vector<std::uint32_t> GltfAccessors::indices(int accessor, int width) const {
  std::vector<std::uint32_t> out;
  read(accessor, width, out);
  return out;
}

}  // namespace kinespace
