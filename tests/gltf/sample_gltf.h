// Small glTF files, put together as the tests want them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace kinespace::test {

[[nodiscard]] inline std::string base64_of(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += k <= count ? digits[word >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

template <typename T>
[[nodiscard]] std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// The bytes of a triangle: three corners, then their indices.
[[nodiscard]] inline std::string triangle_bytes() {
  return bytes_of<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}) + bytes_of<std::uint16_t>({0, 1, 2, 0});
}

[[nodiscard]] inline nlohmann::json view_of(std::size_t offset, std::size_t length) {
  return {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}};
}
[[nodiscard]] inline nlohmann::json accessor_of(int view, int component, std::size_t count, const char* type) {
  return {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}};
}

// One triangle at one node, of accessors 0 and 1, its buffer at `uri`.
[[nodiscard]] inline nlohmann::json triangle_at(const std::string& uri) {
  nlohmann::json out;
  out["asset"]["version"] = "2.0";
  out["scene"] = 0;
  out["scenes"] = {{{"nodes", {0}}}};
  out["nodes"] = {{{"mesh", 0}}};
  out["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}};
  out["buffers"] = {{{"uri", uri}, {"byteLength", triangle_bytes().size()}}};
  out["bufferViews"] = {view_of(0, 36), view_of(36, 6)};
  out["accessors"] = {accessor_of(0, 5126, 3, "VEC3"), accessor_of(1, 5123, 3, "SCALAR")};
  return out;
}
[[nodiscard]] inline std::string data_uri(std::string_view bytes) {
  return "data:application/octet-stream;base64," + base64_of(bytes);
}
[[nodiscard]] inline nlohmann::json triangle() {
  return triangle_at(data_uri(triangle_bytes()));
}

// A .glb file of it.
[[nodiscard]] inline std::string glb_of(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto word = [](std::size_t value) { return bytes_of<std::uint32_t>({static_cast<std::uint32_t>(value)}); };
  std::string out = "glTF" + word(2) + word(28 + json.size() + binary.size());
  out += word(json.size()) + "JSON" + json;
  return out + word(binary.size()) + std::string("BIN\0", 4) + binary;
}

}  // namespace kinespace::test
