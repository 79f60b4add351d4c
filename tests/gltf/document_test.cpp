// Files that ask for more than they are worth: depth, memory, extensions.
#include <functional>
#include <map>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include "kinespace/base/error.h"
#include "kinespace/gltf/detail/json_shape.h"
#include "kinespace/mesh/detail/mesh_formats.h"
#include "tests/gltf/sample_gltf.h"
#include "tests/support/allocation_meter.h"

namespace kinespace::test {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

std::string outcome(const std::string& text, const MeshReadOptions& options = {}) {
  try {
    return parse_gltf_mesh(text, "/nowhere/x.gltf", options).vertices > 0 ? "read" : "nothing";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
}

std::string brackets(std::size_t depth, const char* open, const char* close) {
  std::string out;
  for (std::size_t i = 0; i < depth; ++i) out += open;
  out += '1';
  for (std::size_t i = 0; i < depth; ++i) out += close;
  return out;
}

TEST(GltfDocument, deep_nesting_is_an_error_wherever_it_is) {
  const std::string plain = triangle().dump();
  for (const std::size_t depth : {std::size_t{100}, std::size_t{300'000}}) {
    for (const std::string& deep : {brackets(depth, "[", "]"), brackets(depth, "{\"a\":", "}")}) {
      EXPECT_THAT(outcome(deep), HasSubstr("nested deeper"));
      for (const char* key : {"extras", "nodes", "extensions", "asset", "unknown"}) {
        EXPECT_THAT(outcome("{\"" + std::string(key) + "\":" + deep + "," + plain.substr(1)),
                    HasSubstr("nested deeper"));
      }
      EXPECT_THAT(outcome(deep.substr(0, deep.size() - depth)), HasSubstr("nested deeper")) << "never closed";
    }
    // In a string, brackets are text.
    const std::string quoted = "{\"extras\":\"\\\"" + brackets(depth, "[", "]") + "\\\\\"," + plain.substr(1);
    EXPECT_EQ(outcome(quoted), "read");
  }
  EXPECT_EQ(outcome("{\"extras\":" + brackets(40, "[", "]") + "," + plain.substr(1)), "read");
}

TEST(GltfDocument, extensions_that_change_shapes_are_refused_before_anything_else) {
  for (const char* name : {"KHR_draco_mesh_compression", "EXT_mesh_gpu_instancing", "X"}) {
    Json json = triangle_at("gone.bin");
    json["extensionsRequired"] = {"KHR_materials_unlit", name};
    json["accessors"] = 5;  // nothing of it is looked at
    EXPECT_THAT(outcome(json.dump()), HasSubstr(std::string("requires ") + name));
  }
  for (const char* name : {"KHR_mesh_quantization", "KHR_materials_unlit", "KHR_texture_basisu", "EXT_texture_webp"}) {
    Json json = triangle();
    json["extensionsRequired"] = {name};
    EXPECT_EQ(outcome(json.dump()), "read") << name;
  }
}

// A triangle whose corners and indices are packed by meshopt, the indices in a buffer that has no bytes without it.
Json packed_triangle(const std::string& positions, const std::string& indices) {
  Json json = triangle_at(data_uri(positions + indices));
  json["extensionsRequired"] = {"EXT_meshopt_compression"};
  json["buffers"][0]["byteLength"] = positions.size() + indices.size();
  json["buffers"].push_back({{"byteLength", 42}});
  json["buffers"][1]["extensions"]["EXT_meshopt_compression"]["fallback"] = true;
  json["bufferViews"] = {{{"buffer", 1}, {"byteLength", 36}}, {{"buffer", 1}, {"byteOffset", 36}, {"byteLength", 6}}};
  json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"] = {
      {"buffer", 0}, {"byteLength", positions.size()}, {"byteStride", 12}, {"count", 3}, {"mode", "ATTRIBUTES"}};
  json["bufferViews"][1]["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0},
                                                                     {"byteOffset", positions.size()},
                                                                     {"byteLength", indices.size()},
                                                                     {"byteStride", 2},
                                                                     {"count", 3},
                                                                     {"mode", "TRIANGLES"}};
  return json;
}

TEST(GltfDocument, views_packed_by_meshopt_are_unpacked) {
  const std::vector<float> corners{0, 0, 0, 1, 0, 0, 0, 2.5F, 0};
  const std::vector<unsigned> order{0, 1, 2};
  std::string positions(meshopt_encodeVertexBufferBound(3, 12), '\0'),
      indices(meshopt_encodeIndexBufferBound(3, 3), '\0');
  positions.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(positions.data()), positions.size(),
                                              corners.data(), 3, 12));
  indices.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(indices.data()), indices.size(),
                                           order.data(), order.size()));
  const Json json = packed_triangle(positions, indices);
  const MeshSequence mesh = parse_gltf_mesh(json.dump(), "/nowhere/x.gltf");
  EXPECT_EQ(mesh.positions, corners);
  ASSERT_EQ(mesh.triangles.size(), 1u);

  const auto changed = [&](const char* pointer, Json value) {
    Json other = json;
    other[Json::json_pointer(std::string("/bufferViews/0/extensions/EXT_meshopt_compression/") + pointer)] =
        std::move(value);
    return outcome(other.dump());
  };
  EXPECT_THAT(changed("byteLength", positions.size() - 5), HasSubstr("damage in bufferView 0"));
  EXPECT_THAT(changed("byteLength", 1000), HasSubstr("bytes of its buffer"));
  EXPECT_THAT(changed("byteStride", 6), HasSubstr("a multiple of 4"));
  EXPECT_THAT(changed("mode", "POINTS"), HasSubstr("mode \"POINTS\""));
  EXPECT_THAT(changed("filter", "QUATERNION"), HasSubstr("8 bytes"));
  EXPECT_THAT(changed("count", 1e15), HasSubstr("EXT_meshopt_compression packs that take"));
  EXPECT_THAT(changed("buffer", 9), HasSubstr("fewer than 2"));
}

TEST(GltfDocument, only_the_default_scene_has_shapes) {
  Json json = triangle();
  json["nodes"].push_back({{"mesh", 0}});
  EXPECT_EQ(parse_gltf_mesh(json.dump(), "/nowhere/x.gltf").vertices, 3);
  json["scenes"].push_back({{"nodes", {0, 1}}});
  json["scene"] = 1;
  EXPECT_EQ(parse_gltf_mesh(json.dump(), "/nowhere/x.gltf").vertices, 6);
}

TEST(GltfDocument, draco_that_is_only_used_stands_aside_for_plain_accessors) {
  Json json = triangle();
  json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 0}};
  EXPECT_EQ(outcome(json.dump()), "read");
  json["accessors"][0].erase("bufferView");
  EXPECT_THAT(outcome(json.dump()), HasSubstr("compressed by Draco"));
}

TEST(GltfDocument, what_is_no_glTF_2_says_so) {
  Json json = triangle();
  json["asset"]["version"] = "1.0";
  EXPECT_THAT(outcome(json.dump()), HasSubstr("glTF version 1.0"));
  json.erase("asset");
  EXPECT_THAT(outcome(json.dump()), HasSubstr("no version"));
  EXPECT_THAT(outcome(""), HasSubstr("not JSON"));
  EXPECT_THAT(outcome("[1, 2]"), HasSubstr("an object"));
  EXPECT_THAT(outcome("{\"asset\": 1}"), HasSubstr("an object"));
}

TEST(GltfDocument, members_of_another_type_are_named) {
  const auto changed = [](const char* pointer, Json value) {
    Json json = triangle();
    json[Json::json_pointer(pointer)] = std::move(value);
    return outcome(json.dump());
  };
  EXPECT_THAT(changed("/nodes/0/mesh", "first"), HasSubstr("string at nodes[0].mesh"));
  EXPECT_THAT(changed("/nodes/0/mesh", 0.5), HasSubstr("nodes[0].mesh"));
  EXPECT_THAT(changed("/nodes/0/mesh", 1e300), HasSubstr("nodes[0].mesh"));
  EXPECT_THAT(changed("/nodes/0/translation", {1, 2}), HasSubstr("2 numbers at nodes[0].translation"));
  EXPECT_THAT(changed("/nodes", 7), HasSubstr("a list"));
  EXPECT_THAT(changed("/nodes/0", 7), HasSubstr("nodes[0]"));
  EXPECT_THAT(changed("/accessors/0/count", -5), HasSubstr("accessors[0].count"));
  EXPECT_THAT(changed("/accessors/0/type", "VEC7"), HasSubstr("accessors[0].type"));
  EXPECT_THAT(changed("/meshes/0/primitives/0/attributes/POSITION", Json::array()), HasSubstr("POSITION"));
  EXPECT_THAT(changed("/buffers/0/byteLength", 1e18), HasSubstr("buffers[0].byteLength"));
}

// A triangle whose scale goes from time 0 to time n.
Json triangle_that_grows(int n) {
  const std::string times = bytes_of<float>({0, static_cast<float>(n)});
  Json out = triangle_at(data_uri(triangle_bytes() + times));
  out["buffers"][0]["byteLength"] = 52;
  out["bufferViews"].push_back(view_of(44, 8));
  out["accessors"].push_back(accessor_of(2, 5126, 2, "SCALAR"));
  out["accessors"].push_back(accessor_of(0, 5126, 2, "VEC3"));
  out["animations"] = {{{"samplers", {{{"input", 2}, {"output", 3}}}},
                        {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}}}}};
  return out;
}

// Small files that stand for much, each by another way; `n` says how much.
const std::map<std::string, std::function<Json(int n)>>& greedy() {
  static const std::map<std::string, std::function<Json(int)>> all = {
      {"parts of one node",
       [](int n) {
         Json out = triangle();
         for (int i = 0; i < n; ++i) out["meshes"][0]["primitives"].push_back(out["meshes"][0]["primitives"][0]);
         return out;
       }},
      {"nodes of one mesh",
       [](int n) {
         Json out = triangle();
         for (int i = 0; i < n; ++i) out["nodes"].push_back({{"mesh", 0}});
         return out;
       }},
      {"morph targets",
       [](int n) {
         Json out = triangle();
         for (int i = 0; i < n; ++i) out["meshes"][0]["primitives"][0]["targets"].push_back({{"POSITION", 0}});
         return out;
       }},
      {"skins",
       [](int n) {
         Json out = triangle();
         Json joints = Json::array();
         for (int i = 0; i < 100; ++i) joints.push_back(0);
         for (int i = 0; i < n; ++i) out["skins"].push_back({{"joints", joints}});
         return out;
       }},
      {"joints of every part",
       [](int n) {
         Json out = triangle();
         for (int i = 0; i < n; ++i) out["skins"][0]["joints"].push_back(0);
         for (int i = 0; i < n; ++i) {
           out["scenes"][0]["nodes"].push_back(out["nodes"].size());
           out["nodes"].push_back({{"mesh", 0}, {"skin", 0}});
         }
         return out;
       }},
      {"channels",
       [](int n) {
         Json out = triangle_at(data_uri(triangle_bytes() + bytes_of<float>({0, 1, 2})));
         out["buffers"][0]["byteLength"] = 56;
         out["bufferViews"].push_back(view_of(44, 12));
         out["accessors"].push_back(accessor_of(2, 5126, 3, "SCALAR"));
         for (int i = 0; i < n; ++i) {
           out["animations"][0]["channels"].push_back(
               {{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}});
         }
         out["animations"][0]["samplers"] = {{{"input", 2}, {"output", 0}}};
         return out;
       }},
      {"frames", triangle_that_grows},
      {"frames of many nodes",
       [](int n) {
         Json out = triangle_that_grows(n);
         for (int i = 0; i < 100; ++i) out["nodes"].push_back(Json::object());
         return out;
       }},
      {"objects",
       [](int n) {
         Json out = triangle();
         for (int i = 0; i < n; ++i) out["unknown"].push_back(Json::object());
         return out;
       }},
      {"empty nodes",
       [](int n) {
         Json out = triangle();
         for (int i = 0; i < n; ++i) out["nodes"].push_back(Json::object());
         return out;
       }},
      {"extras",
       [](int n) {
         Json out = triangle();
         for (int i = 0; i < n; ++i) out["extras"].push_back({{"a", Json::array()}});
         return out;
       }},
  };
  return all;
}

// The bound is the same rule whatever its size; a small one needs small files.
TEST(GltfDocument, the_sum_of_all_that_is_decoded_stays_below_the_bound) {
  constexpr std::uint64_t most = 3'000'000;
  constexpr std::size_t spare = 400'000;  // error messages, the odd growing vector
  for (const auto& [name, make] : greedy()) {
    SCOPED_TRACE(name);
    const int n = name == "joints of every part"   ? 3000
                  : name == "skins"                ? 10'000
                  : name == "frames"               ? 30'000
                  : name == "frames of many nodes" ? 2001  // keys so far apart that they give no rate
                                                   : 40'000;
    const std::string text = make(n).dump();
    ASSERT_LT(text.size(), 4'200'000U);
    const AllocationMeter meter;
    EXPECT_THAT(outcome(text, {.most_bytes = most}), HasSubstr("at most 3 MB"));
    EXPECT_LT(meter.peak(), most + spare);
  }
}

TEST(GltfDocument, what_is_refused_for_its_size_is_read_when_more_is_allowed) {
  for (const auto& [name, make] : greedy()) {
    SCOPED_TRACE(name);
    EXPECT_EQ(outcome(make(200).dump(), {.most_bytes = 50'000'000}), "read");
  }
}

TEST(GltfDocument, small_files_get_256_MiB_and_64_times_their_size) {
  Json json = greedy().at("frames")(33'000);  // a million frames at 30 Hz
  for (int i = 0; i < 40; ++i) json["nodes"].push_back({{"mesh", 0}});
  const std::string text = json.dump();
  const AllocationMeter meter;
  EXPECT_THAT(outcome(text), HasSubstr("MB from a file of its size"));
  EXPECT_LT(meter.peak(), (std::size_t{256} << 20) + 64 * text.size());
}

TEST(GltfDocument, reading_stops_when_it_is_asked_to) {
  for (const char* name : {"frames", "objects", "nodes of one mesh"}) {
    const std::string text = greedy().at(name)(20'000).dump();
    for (const int allowed : {0, 1, 3}) {
      int asked = 0;
      const Progress progress{.stop_requested = [&] { return ++asked > allowed; }};
      EXPECT_THROW((void)parse_gltf_mesh(text, "x.gltf", {.progress = progress}), Interrupted) << name;
    }
  }
}

}  // namespace
}  // namespace kinespace::test
