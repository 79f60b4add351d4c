// What a glTF file says of shapes and their movement. Indices are those of the file, -1 for none, and unchecked: who
// follows one checks it. Pictures, materials, cameras, lights and extras are passed over.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/gltf/budget.h"

namespace kinespace::gltf {

// The format's own numbers.
inline constexpr int component_i8 = 5120, component_u8 = 5121, component_i16 = 5122, component_u16 = 5123,
                     component_u32 = 5125, component_f32 = 5126;
inline constexpr int mode_triangles = 4, mode_strip = 5, mode_fan = 6;

struct BufferView {
  int buffer = -1;
  std::uint64_t offset = 0, length = 0;  // bytes
  std::uint64_t stride = 0;              // 0: packed
};

struct SparseValues {
  std::uint64_t count = 0;
  int index_view = -1, index_component = 0;
  std::uint64_t index_offset = 0;
  int value_view = -1;
  std::uint64_t value_offset = 0;
};

struct Accessor {
  int view = -1;
  int component = 0;
  int width = 0;  // numbers an element: 1 to 4, or 16; 0 for the small matrices, which nothing of ours has
  bool normalized = false;
  std::uint64_t offset = 0, count = 0;
  std::optional<SparseValues> sparse;
};

struct Primitive {
  std::map<std::string, int, std::less<>> attributes;  // accessors
  std::vector<int> targets;                            // accessors of the displacements of POSITION
  int indices = -1;
  int mode = mode_triangles;
};

struct Mesh {
  std::vector<Primitive> primitives;
  std::vector<double> weights;
};

// Where a node is in its parent, and how far its morph targets are on. Animations change it.
struct Placement {
  std::optional<std::array<double, 16>> matrix;  // by columns; then there is none of the next three
  std::array<double, 3> translation{0, 0, 0};
  std::array<double, 4> rotation{0, 0, 0, 1};  // x, y, z, w
  std::array<double, 3> scale{1, 1, 1};
  std::vector<double> weights;
};

struct Node {
  std::string name;
  int mesh = -1, skin = -1;
  std::vector<int> children;
  Placement rest;
};

struct Skin {
  std::vector<int> joints;
  int inverse_binds = -1;
};

struct Animation {
  enum class Path : std::uint8_t { translation, rotation, scale, weights };
  enum class Interpolation : std::uint8_t { step, linear, cubic };
  struct Sampler {
    int input = -1, output = -1;
    Interpolation interpolation = Interpolation::linear;
  };
  struct Channel {
    int sampler = -1, node = -1;
    Path path = Path::translation;
  };
  std::string name;
  std::vector<Sampler> samplers;
  std::vector<Channel> channels;  // of nodes, and of the four paths
};

struct Scene {
  std::string name;
  std::vector<int> nodes;
};

struct Document {
  std::vector<std::vector<unsigned char>> buffers;
  std::vector<BufferView> views;
  std::vector<Accessor> accessors;
  std::vector<Mesh> meshes;
  std::vector<Node> nodes;
  std::vector<Skin> skins;
  std::vector<Animation> animations;
  std::vector<Scene> scenes;
  int scene = -1;  // the default one, where the file names it
};

// What is wanted of a file. `motion`: nodes, skins and animations; meshes are passed over, however they are packed.
enum class Content : std::uint8_t { shapes, motion };

// Whether a file that requires the extension can be read for what is wanted: it changes neither shape nor movement, or
// is one that is known (KHR_mesh_quantization, EXT_meshopt_compression).
[[nodiscard]] bool is_readable_extension(std::string_view name, Content wanted);

// Reads a .gltf or .glb file, whichever the bytes are; buffers beside `file` as gltf/detail/buffers.h has it; views that
// EXT_meshopt_compression has packed are unpacked into buffers behind those of the file. In this order: the JSON's depth
// and size, the extensions that it requires, the rest. Throws Error{bad_input}; Interrupted when `progress` says so.
[[nodiscard]] Document read_document(std::string_view bytes, const std::filesystem::path& file, Budget& budget,
                                     const Progress& progress = {}, Content wanted = Content::shapes);

}  // namespace kinespace::gltf
