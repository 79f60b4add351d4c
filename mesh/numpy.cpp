#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/detail/mesh_formats.h"

namespace kinespace {
namespace {

struct Array {
  std::string type;  // "<f4"
  std::vector<std::int64_t> shape;
  std::string_view data;
};

// The header of an .npy file (NumPy's format 1.0 to 3.0): a Python dictionary in one line.
class NumpyReader {
 public:
  NumpyReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  Array read() const {
    if (bytes_.size() < 12 || bytes_.substr(0, 6) != "\x93NUMPY") fail("no NumPy header", "an .npy file");
    const bool long_header = bytes_[6] >= 2;
    const std::size_t start = long_header ? 12 : 10;
    std::size_t length = 0;
    for (std::size_t i = start; i-- > 8;) length = length << 8 | static_cast<unsigned char>(bytes_[i]);
    if (bytes_[6] < 1 || bytes_[6] > 3) fail("another version of the format", "1 to 3");
    if (length > bytes_.size() - start) fail("a header beyond the end of the file", "a whole file (cut short)");
    const std::string_view header = bytes_.substr(start, length);
    Array out{.type = text_after(header, "'descr':"), .shape = shape_of(header), .data = bytes_.substr(start + length)};
    const std::string_view order = value_after(header, "'fortran_order':");
    if (order.substr(0, 5) != "False")
      fail("an array in Fortran order", "C order", "save numpy.ascontiguousarray of it");
    return out;
  }

  [[noreturn]] void fail(std::string found, std::string expected, std::string remedy = {}) const {
    throw Error(
        ErrorKind::bad_input,
        {.file = name_, .found = std::move(found), .expected = std::move(expected), .remedy = std::move(remedy)});
  }

  // Throws unless the data has exactly the numbers of the shape.
  void require_size(const Array& array, std::size_t number_size) const {
    std::uint64_t numbers = 1;
    for (const std::int64_t n : array.shape) {
      const auto count = static_cast<std::uint64_t>(n);
      if (count != 0 && numbers > std::numeric_limits<std::uint64_t>::max() / 16 / count)
        fail("an impossible shape", "a smaller one");
      numbers *= count;
    }
    if (numbers != array.data.size() / number_size || array.data.size() % number_size != 0) {
      fail(fmt::format("{} bytes of numbers", array.data.size()),
           fmt::format("{} times {} by its shape", numbers, number_size));
    }
  }

 private:
  std::string_view value_after(std::string_view header, std::string_view key) const {
    const std::size_t at = header.find(key);
    if (at == std::string_view::npos) fail("a header without " + std::string(key), "it");
    std::string_view out = header.substr(at + key.size());
    out.remove_prefix(std::min(out.find_first_not_of(' '), out.size()));
    return out;
  }

  std::string text_after(std::string_view header, std::string_view key) const {
    const std::string_view value = value_after(header, key);
    const std::size_t end = value.empty() ? std::string_view::npos : value.find('\'', 1);
    if (value.empty() || value[0] != '\'' || end == std::string_view::npos)
      fail("an array of records", "plain numbers");
    return std::string(value.substr(1, end - 1));
  }

  std::vector<std::int64_t> shape_of(std::string_view header) const {
    std::string_view value = value_after(header, "'shape':");
    std::vector<std::int64_t> out;
    if (value.empty() || value[0] != '(') fail("a header without a shape", "one in parentheses");
    for (std::size_t i = 1; i < value.size() && value[i] != ')';) {
      if (value[i] == ' ' || value[i] == ',') {
        ++i;
        continue;
      }
      std::int64_t n = 0;
      const std::size_t first = i;
      for (; i < value.size() && value[i] >= '0' && value[i] <= '9'; ++i) {
        n = n * 10 + (value[i] - '0');
        if (n > std::numeric_limits<std::int32_t>::max()) fail("a dimension of 2^31 or more", "a smaller array");
      }
      if (i == first || out.size() == 8) fail("a shape that is none", "numbers in parentheses");
      out.push_back(n);
    }
    return out;
  }

  std::string_view bytes_;
  std::string name_;
};

template <typename T>
T number_at(std::string_view data, std::size_t i) {
  T out;
  std::memcpy(&out, data.data() + i * sizeof(T), sizeof(T));
  return out;
}

std::string shape_text(const std::vector<std::int64_t>& shape) {
  return fmt::format("shape ({})", fmt::join(shape, ", "));
}

void read_positions(const NumpyReader& reader, MeshSequence& out) {
  const Array array = reader.read();
  const auto& shape = array.shape;
  const bool one = shape.size() == 2;
  if ((shape.size() != 3 && !one) || shape.back() != 3) {
    reader.fail(shape_text(shape), "(frames, vertices, 3), or (vertices, 3) for one frame");
  }
  const std::int64_t frames = one ? 1 : shape[0], vertices = shape[shape.size() - 2];
  if (frames < 1 || vertices < 1 || vertices > most_vertices)
    reader.fail(shape_text(shape), "at least one frame and one vertex");
  const bool wide = array.type == "<f8";
  if (!wide && array.type != "<f4")
    reader.fail("numbers of type " + array.type, "'<f4' or '<f8'", "save it with astype('<f4')");
  reader.require_size(array, wide ? 8 : 4);
  out.frames = static_cast<int>(frames);
  out.vertices = static_cast<int>(vertices);
  out.positions.resize(out.frame_size() * static_cast<std::size_t>(frames));
  if (!wide) {
    std::memcpy(out.positions.data(), array.data.data(), array.data.size());
    return;
  }
  for (std::size_t i = 0; i < out.positions.size(); ++i) {
    const double x = number_at<double>(array.data, i);
    // What does not fit a float is refused with its place by require_valid.
    out.positions[i] =
        std::abs(x) <= largest_coordinate ? static_cast<float>(x) : std::numeric_limits<float>::quiet_NaN();
  }
}

template <typename T>
void copy_triangles(const NumpyReader& reader, const Array& array, MeshSequence& out) {
  reader.require_size(array, sizeof(T));
  out.triangles.resize(static_cast<std::size_t>(array.shape[0]));
  for (std::size_t i = 0; i < out.triangles.size() * 3; ++i) {
    const T index = number_at<T>(array.data, i);
    if (std::cmp_less(index, 0) || std::cmp_greater_equal(index, out.vertices)) {
      reader.fail(fmt::format("triangle {} with vertex {}", i / 3, index), fmt::format("0 to {}", out.vertices - 1));
    }
    out.triangles[i / 3][i % 3] = static_cast<std::int32_t>(index);
  }
}

void read_triangles(const NumpyReader& reader, MeshSequence& out) {
  const Array array = reader.read();
  if (array.shape.size() != 2 || array.shape[1] != 3) reader.fail(shape_text(array.shape), "(triangles, 3)");
  if (array.type == "<i4") {
    copy_triangles<std::int32_t>(reader, array, out);
  } else if (array.type == "<i8") {
    copy_triangles<std::int64_t>(reader, array, out);
  } else if (array.type == "<u4") {
    copy_triangles<std::uint32_t>(reader, array, out);
  } else if (array.type == "<u8") {
    copy_triangles<std::uint64_t>(reader, array, out);
  } else {
    reader.fail("numbers of type " + array.type, "'<i4', '<i8', '<u4' or '<u8'", "save it with astype('<i4')");
  }
}

// 64-byte aligned as NumPy writes it.
std::string header_of(const std::string& type, const std::string& shape) {
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, shape);
  while ((text.size() + 11) % 64 != 0) text += ' ';
  text += '\n';
  std::string out("\x93NUMPY\x01\x00", 8);
  out += static_cast<char>(text.size() & 0xff);
  out += static_cast<char>(text.size() >> 8);
  return out + text;
}

}  // namespace

MeshSequence parse_numpy(std::string_view positions, const std::string& positions_name, std::string_view triangles,
                         const std::string& triangles_name) {
  MeshSequence out;
  read_positions(NumpyReader(positions, positions_name), out);
  read_triangles(NumpyReader(triangles, triangles_name), out);
  require_valid(out, positions_name);
  return out;
}

std::string format_numpy_positions(const MeshSequence& mesh) {
  std::string out = header_of("<f4", fmt::format("{}, {}, 3", mesh.frames, mesh.vertices));
  const auto bytes = std::as_bytes(std::span(mesh.positions));
  out.reserve(out.size() + bytes.size());
  return out.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::string format_numpy_triangles(std::span<const Triangle> triangles) {
  std::string out = header_of("<i4", fmt::format("{}, 3", triangles.size()));
  return out.append(reinterpret_cast<const char*>(triangles.data()), triangles.size_bytes());
}

}  // namespace kinespace
