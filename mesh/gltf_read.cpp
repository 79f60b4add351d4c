#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <tiny_gltf.h>

#include "base/error.h"
#include "mesh/gltf_accessors.h"
#include "mesh/gltf_animation.h"
#include "mesh/mesh_formats.h"

namespace kinespace {
namespace {

// A primitive at a node.
struct Part {
  int node = 0;
  int skin = -1;
  int mesh = 0;
  std::vector<float> positions;
  std::vector<std::vector<float>> targets;                                       // displacements
  std::vector<std::pair<std::vector<std::uint32_t>, std::vector<float>>> bones;  // four joints and weights a vertex

  [[nodiscard]] std::size_t vertices() const { return positions.size() / 3; }
};

class Baker {
 public:
  Baker(const tinygltf::Model& model, const std::string& file)
      : model_(model), accessors_(model, file), order_(gltf_order(model, accessors_)), animation_(model, accessors_) {
    find_parts();
    for (const tinygltf::Skin& skin : model_.skins) inverse_binds_.push_back(inverse_binds_of(skin));
  }

  MeshSequence bake(std::optional<double> rate_hz) {
    const GltfAnimation::Times times = animation_.times(rate_hz, accessors_);
    out_.rate_hz = times.rate_hz;
    out_.frames = static_cast<int>(times.at.size());
    constexpr double most_bytes = 16e9;
    if (static_cast<double>(out_.frame_size()) * 4 * out_.frames > most_bytes) {
      accessors_.fail(fmt::format("{} frames of {} vertices", out_.frames, out_.vertices), "at most 16 GB of positions",
                      "give a lower rate");
    }
    out_.positions.reserve(out_.frame_size() * times.at.size());
    for (const double time : times.at) add_frame(time);
    return std::move(out_);
  }

 private:
  void find_parts() {
    for (const int n : order_) {
      const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(n)];
      if (node.mesh < 0) continue;
      if (static_cast<std::size_t>(node.mesh) >= model_.meshes.size()) {
        accessors_.fail(fmt::format("mesh {}", node.mesh), fmt::format("fewer than {}", model_.meshes.size()));
      }
      if (node.skin >= 0 && static_cast<std::size_t>(node.skin) >= model_.skins.size()) {
        accessors_.fail(fmt::format("skin {}", node.skin), fmt::format("fewer than {}", model_.skins.size()));
      }
      for (const tinygltf::Primitive& primitive : model_.meshes[static_cast<std::size_t>(node.mesh)].primitives) {
        const bool surface = primitive.mode < 0 || (primitive.mode >= TINYGLTF_MODE_TRIANGLES &&
                                                    primitive.mode <= TINYGLTF_MODE_TRIANGLE_FAN);
        if (surface) add_part(n, node, primitive);
      }
    }
    if (parts_.empty()) accessors_.fail("no triangles", "a mesh");
  }

  void add_part(int n, const tinygltf::Node& node, const tinygltf::Primitive& primitive) {
    if (primitive.extensions.contains("KHR_draco_mesh_compression")) {
      accessors_.fail("a mesh compressed by Draco", "plain accessors", "save it without compression");
    }
    Part part{.node = n, .skin = node.skin, .mesh = node.mesh};
    part.positions = accessors_.floats(attribute(primitive, "POSITION"), 3);
    for (const auto& target : primitive.targets) {
      const auto found = target.find("POSITION");
      part.targets.push_back(found == target.end() ? std::vector<float>(part.positions.size())
                                                   : accessors_.floats(found->second, 3));
      require_count(part.targets.back().size(), part.positions.size());
    }
    if (part.skin >= 0) add_bones(primitive, part);
    add_triangles(primitive, part.vertices());
    if (static_cast<std::int64_t>(part.vertices()) > most_vertices - out_.vertices) {
      accessors_.fail("too many vertices", fmt::format("at most {}", most_vertices));
    }
    out_.vertices += static_cast<int>(part.vertices());
    parts_.push_back(std::move(part));
  }

  int attribute(const tinygltf::Primitive& primitive, const std::string& name) const {
    const auto found = primitive.attributes.find(name);
    if (found == primitive.attributes.end()) accessors_.fail("a mesh without " + name, "this attribute");
    return found->second;
  }

  void require_count(std::size_t found, std::size_t expected) const {
    if (found != expected)
      accessors_.fail(fmt::format("an attribute of {} numbers", found), fmt::format("{}", expected));
  }

  void add_bones(const tinygltf::Primitive& primitive, Part& part) const {
    for (int set = 0; primitive.attributes.contains(fmt::format("JOINTS_{}", set)); ++set) {
      auto joints = accessors_.indices(attribute(primitive, fmt::format("JOINTS_{}", set)), 4);
      auto weights = accessors_.floats(attribute(primitive, fmt::format("WEIGHTS_{}", set)), 4);
      require_count(joints.size(), part.vertices() * 4);
      require_count(weights.size(), part.vertices() * 4);
      const auto& bones = model_.skins[static_cast<std::size_t>(part.skin)].joints;
      for (std::size_t i = 0; i < joints.size(); ++i) {
        if (joints[i] >= bones.size() && weights[i] != 0) {
          accessors_.fail(fmt::format("a vertex on joint {}", joints[i]), fmt::format("fewer than {}", bones.size()));
        }
      }
      part.bones.emplace_back(std::move(joints), std::move(weights));
    }
  }

  void add_triangles(const tinygltf::Primitive& primitive, std::size_t vertices) {
    std::vector<std::uint32_t> corners;
    if (primitive.indices >= 0) {
      corners = accessors_.indices(primitive.indices, 1);
    } else {
      for (std::size_t v = 0; v < vertices; ++v) corners.push_back(static_cast<std::uint32_t>(v));
    }
    for (const std::uint32_t v : corners) {
      if (v >= vertices)
        accessors_.fail(fmt::format("a triangle with vertex {}", v), fmt::format("fewer than {}", vertices));
    }
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      const auto vertex = [&](std::size_t i) { return out_.vertices + static_cast<std::int32_t>(corners[i]); };
      out_.triangles.push_back({vertex(a), vertex(b), vertex(c)});
    };
    const bool strip = primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP,
               fan = primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN;
    const std::size_t step = strip || fan ? 1 : 3;
    for (std::size_t i = 0; i + 2 < corners.size(); i += step) {
      if (fan) {
        add(i + 1, i + 2, 0);
      } else if (strip && i % 2 == 1) {
        add(i, i + 2, i + 1);
      } else {
        add(i, i + 1, i + 2);
      }
    }
  }

  std::vector<Eigen::Matrix4d> inverse_binds_of(const tinygltf::Skin& skin) const {
    std::vector<Eigen::Matrix4d> out(skin.joints.size(), Eigen::Matrix4d::Identity());
    for (const int joint : skin.joints) {
      if (joint < 0 || static_cast<std::size_t>(joint) >= model_.nodes.size()) {
        accessors_.fail(fmt::format("a skin with joint {}", joint), "a node of the file");
      }
    }
    if (skin.inverseBindMatrices < 0) return out;
    const std::vector<float> numbers = accessors_.floats(skin.inverseBindMatrices, 16);
    if (numbers.size() < out.size() * 16) accessors_.fail("a skin with fewer matrices than joints", "one for each");
    for (std::size_t j = 0; j < out.size(); ++j) {
      out[j] = Eigen::Map<const Eigen::Matrix4f>(numbers.data() + 16 * j).cast<double>();
    }
    return out;
  }

  void add_frame(double time) {
    GltfPose pose = gltf_pose(model_, animation_, time);
    // Parents come first in the order, so every node meets its parent's finished matrix.
    for (const int n : order_) {
      for (const int child : model_.nodes[static_cast<std::size_t>(n)].children) {
        auto& local = pose.local[static_cast<std::size_t>(child)];
        local = pose.local[static_cast<std::size_t>(n)] * local;
      }
    }
    for (const Part& part : parts_) add_part_positions(part, pose);
  }

  void add_part_positions(const Part& part, const GltfPose& pose) {
    std::vector<float> moved = part.positions;
    const auto& own = pose.weights[static_cast<std::size_t>(part.node)];
    const auto& weights = own.empty() ? model_.meshes[static_cast<std::size_t>(part.mesh)].weights : own;
    for (std::size_t t = 0; t < std::min(part.targets.size(), weights.size()); ++t) {
      if (weights[t] == 0) continue;
      for (std::size_t i = 0; i < moved.size(); ++i) {
        moved[i] =
            static_cast<float>(static_cast<double>(moved[i]) + weights[t] * static_cast<double>(part.targets[t][i]));
      }
    }
    std::vector<Eigen::Matrix4d> bones;
    if (part.skin >= 0) {
      const auto& joints = model_.skins[static_cast<std::size_t>(part.skin)].joints;
      for (std::size_t j = 0; j < joints.size(); ++j) {
        bones.push_back(pose.local[static_cast<std::size_t>(joints[j])] *
                        inverse_binds_[static_cast<std::size_t>(part.skin)][j]);
      }
    }
    const Eigen::Matrix4d& still = pose.local[static_cast<std::size_t>(part.node)];
    const bool moves = !still.isIdentity(0);
    for (std::size_t v = 0; v < part.vertices(); ++v) {
      if (part.bones.empty() && !moves) {
        out_.positions.insert(out_.positions.end(), &moved[3 * v], &moved[3 * v] + 3);
        continue;
      }
      const Eigen::Vector4d p(static_cast<double>(moved[3 * v]), static_cast<double>(moved[3 * v + 1]),
                              static_cast<double>(moved[3 * v + 2]), 1);
      const Eigen::Vector4d q = part.bones.empty() ? Eigen::Vector4d(still * p) : skinned(part, bones, v, p);
      for (int c = 0; c < 3; ++c) out_.positions.push_back(static_cast<float>(q[c]));
    }
  }

  // The node's own matrix does not count for a skinned mesh.
  static Eigen::Vector4d skinned(const Part& part, const std::vector<Eigen::Matrix4d>& bones, std::size_t v,
                                 const Eigen::Vector4d& p) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    double total = 0;
    for (const auto& [joints, weights] : part.bones) {
      for (std::size_t k = 4 * v; k < 4 * v + 4; ++k) {
        const double weight = static_cast<double>(weights[k]);
        if (weight == 0) continue;
        sum += weight * (bones[joints[k]] * p);
        total += weight;
      }
    }
    return total > 0 ? Eigen::Vector4d(sum / total) : p;
  }

  const tinygltf::Model& model_;
  GltfAccessors accessors_;
  std::vector<int> order_;
  GltfAnimation animation_;
  std::vector<Part> parts_;
  std::vector<std::vector<Eigen::Matrix4d>> inverse_binds_;
  MeshSequence out_;
};

bool no_image(tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*, int, void*) {
  return true;  // pictures are none of our business
}

}  // namespace

MeshSequence parse_gltf_mesh(std::string_view bytes, const std::filesystem::path& file, std::optional<double> rate_hz) {
  const auto fail = [&](std::string found, std::string expected) {
    throw Error(ErrorKind::bad_input,
                {.file = file.string(), .found = std::move(found), .expected = std::move(expected)});
  };
  if (bytes.size() > std::numeric_limits<std::uint32_t>::max()) fail("a file above 4 GB", "a smaller one");
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(no_image, nullptr);
  tinygltf::Model model;
  std::string error, warning;
  const auto size = static_cast<unsigned>(bytes.size());
  const std::string folder = file.parent_path().string();
  const bool binary = bytes.substr(0, 4) == "glTF";
  const bool loaded =
      binary ? loader.LoadBinaryFromMemory(&model, &error, &warning,
                                           reinterpret_cast<const unsigned char*>(bytes.data()), size, folder)
             : loader.LoadASCIIFromString(&model, &error, &warning, bytes.data(), size, folder);
  if (!loaded) fail("what glTF's reader refuses: " + error, "a glTF 2.0 file");
  MeshSequence out = Baker(model, file.string()).bake(rate_hz);
  require_valid(out, file.string());
  return out;
}

}  // namespace kinespace
