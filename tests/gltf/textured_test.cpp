// Files as artists make them, with pictures and all, in a program that links Draco's shared library first.
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "kinespace/mesh/detail/mesh_formats.h"
#include "tests/gltf/sample_gltf.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

using Json = nlohmann::json;

Json with(const char* key, Json value) {
  Json out = triangle();
  out[key] = std::move(value);
  return out;
}

std::map<std::string, Json> dressed() {
  const std::string png = "data:image/png;base64,iVBORw0KGgo=";
  std::map<std::string, Json> out;
  out["plain"] = triangle();
  out["material without anything"] = with("materials", {Json::object()});
  out["material"] = with("materials", {{{"name", "red"},
                                        {"pbrMetallicRoughness",
                                         {{"baseColorFactor", {1, 0, 0, 1}},
                                          {"metallicFactor", 0},
                                          {"baseColorTexture", {{"index", 0}, {"texCoord", 0}}}}},
                                        {"normalTexture", {{"index", 0}, {"scale", 2}}},
                                        {"extras", {{"shader", {1, "two", true, nullptr}}}}}});
  out["sampler"] = with("samplers", {{{"magFilter", 9729}, {"minFilter", 9987}}});
  out["picture inside"] = with("images", {{{"uri", png}}});
  out["picture in the buffer"] = with("images", {{{"bufferView", 0}, {"mimeType", "image/png"}}});
  out["picture beyond the buffer"] = with("images", {{{"bufferView", 1000}, {"mimeType", "image/png"}}});
  out["picture that is missing"] = with("images", {{{"uri", "missing.png"}}});
  out["picture elsewhere"] = with("images", {{{"uri", "../../../../etc/passwd"}}});
  out["texture"] = with("textures", {{{"sampler", 0}, {"source", 0}, {"name", "wood"}}});
  out["camera"] = with("cameras", {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}}});
  out["light"] = with("extensions", {{"KHR_lights_punctual", {{"lights", {{{"type", "point"}}}}}}});
  out["asset"] = triangle();
  out["asset"]["asset"].update({{"generator", "X"}, {"copyright", "y"}, {"extras", {{"a", 1}, {"b", {1, 2}}}}});
  out["extras of a node"] = triangle();
  out["extras of a node"]["nodes"][0]["extras"] = {{"a", 1}, {"b", {{"c", {1, "x", true}}}}};
  out["extras of a mesh"] = triangle();
  out["extras of a mesh"]["meshes"][0]["extras"]["targetNames"] = {"a"};
  out["required but harmless"] = with("extensionsRequired", {"KHR_materials_unlit", "KHR_texture_transform"});
  return out;
}

void expect_triangle(const MeshSequence& mesh) {
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  EXPECT_EQ(mesh.positions, (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}));
}

TEST(TexturedGltf, is_read_whatever_a_file_has_beside_its_shapes) {
  for (const auto& [name, json] : dressed()) {
    SCOPED_TRACE(name);
    expect_triangle(parse_gltf_mesh(json.dump(), "x.gltf"));
    Json packed = json;
    packed["buffers"][0].erase("uri");
    expect_triangle(parse_gltf_mesh(glb_of(packed.dump(), triangle_bytes()), "x.glb"));
  }
}

TEST(TexturedGltf, is_written_whichever_library_comes_first) {
  const MeshSequence mesh = bending_tube(100, 4, 0.5);
  for (const bool binary : {false, true}) {
    const MeshSequence back = parse_gltf_mesh(format_gltf_mesh(mesh, binary), "x.gltf");
    EXPECT_EQ(back.triangles, mesh.triangles);
    EXPECT_EQ(back.frames, mesh.frames);
  }
}

}  // namespace
}  // namespace kinespace::test
