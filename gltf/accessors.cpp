#include "kinespace/gltf/accessors.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace::gltf {
namespace {

// 0 for what is no component type.
std::size_t component_size(int component) {
  switch (component) {
    case component_i8:
    case component_u8:
      return 1;
    case component_i16:
    case component_u16:
      return 2;
    case component_u32:
    case component_f32:
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
    case component_i8:
      return scaled(raw<std::int8_t>(at), 127);
    case component_u8:
      return scaled(raw<std::uint8_t>(at), 255);
    case component_i16:
      return scaled(raw<std::int16_t>(at), 32767);
    case component_u16:
      return scaled(raw<std::uint16_t>(at), 65535);
    case component_u32:
      return raw<std::uint32_t>(at);
    default:
      return static_cast<double>(raw<float>(at));
  }
}

}  // namespace

Accessors::Accessors(const Document& document, const std::string& file, Budget& budget)
    : document_(document), file_(file), budget_(budget) {
  for (const Accessor& a : document_.accessors) {
    if (a.view < 0 || component_size(a.component) == 0 || a.width == 0) continue;
    (void)view_of(a.view, a.offset, a.count, a.component, a.width);
    most_count_ = std::max(most_count_, a.count);
  }
}

void Accessors::fail(std::string found, std::string expected, std::string remedy) const {
  throw Error(ErrorKind::bad_input,
              {.file = file_, .found = std::move(found), .expected = std::move(expected), .remedy = std::move(remedy)});
}

Accessors::View Accessors::view_of(int buffer_view, std::uint64_t offset, std::uint64_t count, int component,
                                   int width) const {
  if (buffer_view < 0 || static_cast<std::size_t>(buffer_view) >= document_.views.size()) {
    fail(fmt::format("bufferView {}", buffer_view), fmt::format("fewer than {}", document_.views.size()));
  }
  const BufferView& view = document_.views[static_cast<std::size_t>(buffer_view)];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= document_.buffers.size()) {
    fail(fmt::format("buffer {}", view.buffer), fmt::format("fewer than {}", document_.buffers.size()));
  }
  const auto& data = document_.buffers[static_cast<std::size_t>(view.buffer)];
  const std::uint64_t size = component_size(component) * static_cast<std::size_t>(width);
  const std::uint64_t stride = view.stride == 0 ? size : view.stride;
  if (size == 0 || view.offset > data.size() || view.length > data.size() - view.offset) {
    fail(fmt::format("bufferView {} beyond its buffer", buffer_view), fmt::format("{} bytes at most", data.size()));
  }
  const bool fits = count == 0 || (offset <= view.length && size <= view.length - offset &&
                                   count - 1 <= (view.length - offset - size) / stride);
  if (!fits) fail(fmt::format("{} elements in bufferView {}", count, buffer_view), "as many as it has bytes for");
  if (count == 0) return {data.data(), stride, 0, component};
  return {data.data() + view.offset + offset, stride, count, component};
}

std::size_t Accessors::count_of(int accessor, int width) const {
  if (accessor < 0 || static_cast<std::size_t>(accessor) >= document_.accessors.size()) {
    fail(fmt::format("accessor {}", accessor), fmt::format("fewer than {}", document_.accessors.size()));
  }
  const Accessor& a = document_.accessors[static_cast<std::size_t>(accessor)];
  if (a.width != width || component_size(a.component) == 0) {
    fail(fmt::format("accessor {} of another type", accessor), fmt::format("elements of {} numbers", width));
  }
  if (a.view < 0 && a.count > most_count_) {
    fail(fmt::format("accessor {} with {} elements and no data", accessor, a.count),
         fmt::format("at most {}", most_count_));
  }
  return a.count;
}

template <typename T>
void Accessors::read(int accessor, int width, std::vector<T>& out) const {
  const std::size_t count = count_of(accessor, width);
  const Accessor& a = document_.accessors[static_cast<std::size_t>(accessor)];
  const auto components = static_cast<std::size_t>(width);
  const std::size_t size = component_size(a.component);
  const auto copy = [&](const View& from, std::size_t element, std::size_t to) {
    for (std::size_t c = 0; c < components; ++c) {
      const double value = component_at(from.data + element * from.stride + c * size, from.component, a.normalized);
      out[to * components + c] = static_cast<T>(std::is_integral_v<T> ? std::clamp(value, 0.0, 4294967295.0) : value);
    }
  };
  budget_.take(fmt::format("the numbers of accessor {}", accessor), count, components * sizeof(T));
  if (a.view >= 0) {
    const View view = view_of(a.view, a.offset, count, a.component, width);
    out.resize(count * components);
    for (std::size_t i = 0; i < count; ++i) copy(view, i, i);
  } else {
    out.assign(count * components, T{});
  }
  if (!a.sparse) return;
  const SparseValues& sparse = *a.sparse;
  const View at = view_of(sparse.index_view, sparse.index_offset, sparse.count, sparse.index_component, 1);
  const View values = view_of(sparse.value_view, sparse.value_offset, sparse.count, a.component, width);
  for (std::size_t i = 0; i < sparse.count; ++i) {
    const double index = component_at(at.data + i * at.stride, at.component, false);
    if (!(index >= 0 && index < static_cast<double>(count))) {
      fail(fmt::format("sparse index {} of accessor {}", index, accessor), fmt::format("below {}", count));
    }
    copy(values, i, static_cast<std::size_t>(index));
  }
}

std::vector<float> Accessors::floats(int accessor, int width) const {
  std::vector<float> out;
  read(accessor, width, out);
  return out;
}

std::vector<std::uint32_t> Accessors::indices(int accessor, int width) const {
  std::vector<std::uint32_t> out;
  read(accessor, width, out);
  return out;
}

}  // namespace kinespace::gltf
