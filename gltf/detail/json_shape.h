// What a JSON text would take as a tree, before anything is built from it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace kinespace::gltf {

// glTF itself nests 8 deep; what others keep in "extras" is hardly deeper.
inline constexpr int deepest_json = 64;

// The bytes that nlohmann::json takes for it, generously. Looks at brackets, separators and strings only: whether the
// text is JSON at all is the parser's business. Throws Error{bad_input} when it nests deeper than `deepest_json`.
[[nodiscard]] std::uint64_t json_tree_bytes(std::string_view json, const std::string& file);

}  // namespace kinespace::gltf
