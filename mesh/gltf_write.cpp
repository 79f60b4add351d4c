#include <algorithm>
#include <cstring>
#include <sstream>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/gltf/arrays.h"
#include "kinespace/gltf/tiny.h"
#include "kinespace/mesh/detail/mesh_formats.h"

namespace kinespace {
namespace {

// One mesh, frame 0, with the displacement to every other frame as a morph target; at the time of frame f the weights
// are 1 for its own target and 0 for the rest.
class Writer {
 public:
  explicit Writer(const MeshSequence& mesh) : mesh_(mesh), arrays_(model_) {}

  tinygltf::Model write() && {
    model_.asset.version = "2.0";
    model_.asset.generator = "kinespace";
    add_mesh();
    if (mesh_.frames > 1) add_animation();
    return std::move(model_);
  }

 private:
  void add_mesh() {
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    std::vector<std::uint32_t> corners;
    for (const Triangle& t : mesh_.triangles) corners.insert(corners.end(), t.begin(), t.end());
    // Without triangles there are only points to show.
    if (corners.empty()) primitive.mode = TINYGLTF_MODE_POINTS;
    if (!corners.empty()) {
      primitive.indices = arrays_.add(std::span<const std::uint32_t>(corners), TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                                      TINYGLTF_TYPE_SCALAR, corners.size(), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    }
    const auto base = mesh_.frame(0);
    primitive.attributes["POSITION"] = arrays_.add_ranged(base, TINYGLTF_TYPE_VEC3, 3, TINYGLTF_TARGET_ARRAY_BUFFER);
    std::vector<float> moved(base.size());
    for (int f = 1; f < mesh_.frames; ++f) {
      const auto frame = mesh_.frame(f);
      for (std::size_t i = 0; i < moved.size(); ++i) moved[i] = frame[i] - base[i];
      primitive.targets.push_back({{"POSITION", arrays_.add_ranged(moved, TINYGLTF_TYPE_VEC3, 3)}});
    }
    tinygltf::Mesh mesh;
    mesh.name = "mesh";
    mesh.weights.assign(primitive.targets.size(), 0);
    mesh.primitives.push_back(std::move(primitive));
    model_.meshes.push_back(std::move(mesh));
    tinygltf::Node node;
    node.name = "mesh";
    node.mesh = 0;
    model_.nodes.push_back(std::move(node));
    tinygltf::Scene scene;
    scene.nodes = {0};
    model_.scenes.push_back(std::move(scene));
    model_.defaultScene = 0;
  }

  void add_animation() {
    const auto frames = static_cast<std::size_t>(mesh_.frames);
    std::vector<float> times, weights(frames * (frames - 1));
    for (std::size_t f = 0; f < frames; ++f) {
      times.push_back(static_cast<float>(static_cast<double>(f) / mesh_.rate_hz));
      if (f > 0) weights[f * (frames - 1) + f - 1] = 1;
    }
    tinygltf::AnimationSampler sampler;
    sampler.input = arrays_.add_ranged(times, TINYGLTF_TYPE_SCALAR, 1);
    sampler.output = arrays_.add_floats(weights, TINYGLTF_TYPE_SCALAR, 1);
    sampler.interpolation = "LINEAR";
    tinygltf::AnimationChannel channel;
    channel.sampler = 0;
    channel.target_node = 0;
    channel.target_path = "weights";
    tinygltf::Animation animation;
    animation.name = "frames";
    animation.samplers.push_back(std::move(sampler));
    animation.channels.push_back(std::move(channel));
    model_.animations.push_back(std::move(animation));
  }

  const MeshSequence& mesh_;
  tinygltf::Model model_;
  GltfArrays arrays_;
};

}  // namespace

std::string format_gltf_mesh(const MeshSequence& mesh, bool binary) {
  constexpr double largest = 2e9;
  const double frames = mesh.frames;
  const double bytes = static_cast<double>(mesh.positions.size()) * 4 + frames * frames * 4 +
                       static_cast<double>(mesh.triangles.size()) * 12;
  if (bytes > largest) {
    throw Error(ErrorKind::bad_input, {.file = mesh.name,
                                       .found = fmt::format("{} frames of {} vertices", mesh.frames, mesh.vertices),
                                       .expected = "a sequence that one glTF file can hold, 2 GB",
                                       .remedy = "write NumPy files, or fewer frames"});
  }
  const tinygltf::Model model = Writer(mesh).write();
  std::ostringstream out;
  tinygltf::TinyGLTF().WriteGltfSceneToStream(&model, out, false, binary);
  return std::move(out).str();
}

}  // namespace kinespace
