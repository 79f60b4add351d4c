#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/detail/mesh_formats.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

enum class Type : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

struct Property {
  std::string name;
  Type type = Type::u8;
  bool list = false;
  Type count_type = Type::u8;
};
struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;
};

std::size_t size_of(Type type) {
  switch (type) {
    case Type::i8:
    case Type::u8:
      return 1;
    case Type::i16:
    case Type::u16:
      return 2;
    case Type::i32:
    case Type::u32:
    case Type::f32:
      return 4;
    case Type::f64:
      break;
  }
  return 8;
}

class PlyReader {
 public:
  PlyReader(std::string_view bytes, const std::string& name, const Progress& progress)
      : name_(name), progress_(progress), left_(bytes) {}

  MeshFrame read() {
    read_header();
    bool vertices = false;
    for (const Element& element : elements_) {
      require_room(element);
      if (element.name == "vertex") {
        read_vertices(element);
        vertices = true;
      } else if (element.name == "face") {
        read_faces(element);
      } else {
        for (std::int64_t i = 0; i < element.count; ++i) {
          for (const Property& property : element.properties) skip(property);
        }
      }
    }
    if (!vertices || out_.positions.empty()) fail("no vertices", "an element vertex");
    const auto count = static_cast<std::int32_t>(out_.positions.size() / 3);
    for (const Triangle& t : out_.triangles) {
      for (const std::int32_t v : t) {
        if (v < 0 || v >= count) fail(fmt::format("a face with vertex {}", v), fmt::format("0 to {}", count - 1));
      }
    }
    return std::move(out_);
  }

 private:
  [[noreturn]] void fail(std::string found, std::string expected, std::string remedy = {}) const {
    throw Error(ErrorKind::bad_input, {.file = name_,
                                       .line = line_,
                                       .found = std::move(found),
                                       .expected = std::move(expected),
                                       .remedy = std::move(remedy)});
  }

  std::vector<std::string> header_line() {
    ++line_;
    const std::size_t end = left_.find('\n');
    if (end == std::string_view::npos || end > 10'000) fail("the end of the file", "the line end_header");
    std::vector<std::string> words;
    std::string_view line = left_.substr(0, end);
    left_.remove_prefix(end + 1);
    while (!line.empty()) {
      const auto blank = [](char c) { return is_space(c); };
      line.remove_prefix(static_cast<std::size_t>(std::find_if_not(line.begin(), line.end(), blank) - line.begin()));
      const auto word = static_cast<std::size_t>(std::find_if(line.begin(), line.end(), blank) - line.begin());
      if (word > 0) words.emplace_back(line.substr(0, word));
      line.remove_prefix(word);
    }
    return words;
  }

  Type type_of(const std::string& word) const {
    constexpr std::pair<std::string_view, Type> names[] = {
        {"char", Type::i8},   {"int8", Type::i8},     {"uchar", Type::u8},   {"uint8", Type::u8},
        {"short", Type::i16}, {"int16", Type::i16},   {"ushort", Type::u16}, {"uint16", Type::u16},
        {"int", Type::i32},   {"int32", Type::i32},   {"uint", Type::u32},   {"uint32", Type::u32},
        {"float", Type::f32}, {"float32", Type::f32}, {"double", Type::f64}, {"float64", Type::f64}};
    for (const auto& [name, type] : names) {
      if (word == name) return type;
    }
    fail(word, "a type of a property");
  }

  void read_header() {
    if (header_line() != std::vector<std::string>{"ply"}) fail("another first line", "ply");
    bool format = false;
    for (;;) {
      const std::vector<std::string> words = header_line();
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") break;
      if (words[0] == "format" && words.size() == 3) {
        if (words[1] == "ascii") fail("a PLY file in text", "a binary one", "save it as binary");
        if (words[1] != "binary_little_endian" && words[1] != "binary_big_endian") fail(words[1], "a binary format");
        swap_ = (words[1] == "binary_big_endian") == (std::endian::native == std::endian::little);
        format = true;
      } else if (words[0] == "element" && words.size() == 3) {
        elements_.push_back({words[1], count_of(words[2]), {}});
      } else if (words[0] == "property" && !elements_.empty() && (words.size() == 3 || words.size() == 5)) {
        elements_.back().properties.push_back(property_of(words));
      } else {
        fail(words[0], "format, element, property, comment or end_header");
      }
    }
    if (!format) fail("no format", "a line that begins with format");
    line_ = 0;  // what follows has no lines
  }

  std::int64_t count_of(const std::string& word) const {
    double value = 0;
    const char* const end = scan_number(word.data(), word.data() + word.size(), value);
    if (end != word.data() + word.size() || !(value >= 0 && value <= 1e9) || value != std::floor(value)) {
      fail(word, "a number of elements");
    }
    return static_cast<std::int64_t>(value);
  }

  Property property_of(const std::vector<std::string>& words) const {
    if (words.size() == 3) return {.name = words[2], .type = type_of(words[1])};
    if (words[1] != "list") fail(words[1], "list");
    Property out{.name = words[4], .type = type_of(words[3]), .list = true, .count_type = type_of(words[2])};
    if (out.count_type == Type::f32 || out.count_type == Type::f64) fail(words[2], "a whole number type");
    return out;
  }

  // Every element takes bytes: a count that the file cannot hold is a lie.
  void require_room(const Element& element) const {
    std::size_t least = 0;
    for (const Property& p : element.properties) least += size_of(p.list ? p.count_type : p.type);
    if (least == 0 && element.count > 0) fail("element " + element.name + " without properties", "properties");
    if (element.count > 0 && static_cast<std::size_t>(element.count) > left_.size() / least) {
      fail(fmt::format("{} bytes for {} of element {}", left_.size(), element.count, element.name), "more (cut short)");
    }
  }

  template <typename T>
  T get() {
    if (left_.size() < sizeof(T)) fail("the end of the file", "more (cut short)");
    char raw[sizeof(T)];
    std::copy_n(left_.begin(), sizeof(T), raw);
    if (swap_) std::reverse(raw, raw + sizeof(T));
    left_.remove_prefix(sizeof(T));
    T out;
    std::memcpy(&out, raw, sizeof(T));
    return out;
  }

  double number(Type type) {
    switch (type) {
      case Type::i8:
        return get<std::int8_t>();
      case Type::u8:
        return get<std::uint8_t>();
      case Type::i16:
        return get<std::int16_t>();
      case Type::u16:
        return get<std::uint16_t>();
      case Type::i32:
        return get<std::int32_t>();
      case Type::u32:
        return get<std::uint32_t>();
      case Type::f32:
        return static_cast<double>(get<float>());
      case Type::f64:
        break;
    }
    return get<double>();
  }

  void skip(const Property& property) {
    const double count = property.list ? number(property.count_type) : 1;
    if (count < 0 || count > static_cast<double>(left_.size() / size_of(property.type))) {
      fail("a list beyond the end of the file", "a shorter one");
    }
    left_.remove_prefix(static_cast<std::size_t>(count) * size_of(property.type));
  }

  void read_vertices(const Element& element) {
    if (!out_.positions.empty()) fail("a second element vertex", "one");
    if (element.count > most_vertices)
      fail(fmt::format("{} vertices", element.count), fmt::format("at most {}", most_vertices));
    int place[3] = {-1, -1, -1};
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      for (int c = 0; c < 3; ++c) {
        if (element.properties[p].name == std::string(1, "xyz"[c]) && !element.properties[p].list)
          place[c] = static_cast<int>(p);
      }
    }
    if (place[0] < 0 || place[1] < 0 || place[2] < 0) fail("vertices without x, y and z", "these three properties");
    out_.positions.resize(static_cast<std::size_t>(element.count) * 3);
    for (std::size_t v = 0; v < static_cast<std::size_t>(element.count); ++v) {
      if (v % 65536 == 0) progress_.check_stop();
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const auto c = static_cast<std::size_t>(std::find(place, place + 3, static_cast<int>(p)) - place);
        if (c == 3) {
          skip(element.properties[p]);
          continue;
        }
        const double x = number(element.properties[p].type);
        if (!(std::abs(x) <= largest_coordinate))
          fail(fmt::format("vertex {} with {} = {}", v, "xyz"[c], x), "a finite number");
        out_.positions[3 * v + c] = static_cast<float>(x);
      }
    }
  }

  void read_faces(const Element& element) {
    if (!out_.triangles.empty()) fail("a second element face", "one");
    for (std::int64_t f = 0; f < element.count; ++f) {
      if (f % 65536 == 0) progress_.check_stop();
      for (const Property& property : element.properties) {
        const bool corners = property.list && (property.name == "vertex_indices" || property.name == "vertex_index");
        corners ? read_polygon(property) : skip(property);
      }
    }
  }

  void read_polygon(const Property& property) {
    const double count = number(property.count_type);
    if (count < 3 || count > static_cast<double>(left_.size() / size_of(property.type))) {
      fail(fmt::format("a face with {} vertices", count), "three or more, not beyond the end of the file");
    }
    std::int32_t first = 0, before = 0;
    for (int k = 0; k < static_cast<int>(count); ++k) {
      const double index = number(property.type);
      if (!(index >= 0 && index < static_cast<double>(most_vertices)))
        fail(fmt::format("a face with vertex {}", index), "a vertex");
      const auto v = static_cast<std::int32_t>(index);
      if (k == 0) first = v;
      if (k >= 2) out_.triangles.push_back({first, before, v});
      before = v;
    }
  }

  std::string name_;
  const Progress& progress_;
  std::string_view left_;
  std::int64_t line_ = 0;
  bool swap_ = false;
  std::vector<Element> elements_;
  MeshFrame out_;
};

}  // namespace

MeshFrame parse_ply(std::string_view bytes, const std::string& name, const Progress& progress) {
  return PlyReader(bytes, name, progress).read();
}

std::string format_ply(std::span<const float> positions, std::span<const Triangle> triangles) {
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      positions.size() / 3, triangles.size());
  out.reserve(out.size() + positions.size_bytes() + triangles.size() * 13);
  out.append(reinterpret_cast<const char*>(positions.data()), positions.size_bytes());
  for (const Triangle& t : triangles) {
    out += '\3';
    out.append(reinterpret_cast<const char*>(t.data()), sizeof(Triangle));
  }
  return out;
}

}  // namespace kinespace
