#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/gltf/accessors.h"
#include "kinespace/gltf/document.h"
#include "kinespace/gltf/nodes.h"
#include "kinespace/mesh/detail/gltf_animation.h"
#include "kinespace/mesh/detail/mesh_formats.h"

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

// How many vertices are moved between two looks at whether to stop: some milliseconds.
constexpr std::size_t stop_stride = 65536;

class Baker {
 public:
  Baker(const gltf::Document& document, const std::string& file, gltf::Budget& budget, const Progress& progress,
        std::size_t animation)
      : document_(document),
        accessors_(document, file, budget),
        budget_(budget),
        progress_(progress),
        tree_(gltf::node_tree(document, accessors_)),
        animation_(document, accessors_, animation) {
    find_parts();
    for (const gltf::Skin& skin : document_.skins) inverse_binds_.push_back(inverse_binds_of(skin));
  }

  MeshSequence bake(std::optional<double> rate_hz) {
    const GltfAnimation::Times times = animation_.times(rate_hz, accessors_);
    out_.rate_hz = times.rate_hz;
    out_.frames = static_cast<int>(times.at.size());
    budget_.take(fmt::format("{} frames of {} vertices", out_.frames, out_.vertices), times.at.size(),
                 out_.frame_size() * sizeof(float));
    take_work(times.at.size());
    out_.positions.reserve(out_.frame_size() * times.at.size());
    for (const double time : times.at) {
      progress_.at("baking", static_cast<double>(out_.positions.size()) /
                                 static_cast<double>(out_.frame_size() * times.at.size()));
      add_frame(time);
    }
    return std::move(out_);
  }

 private:
  // What is made anew for every frame: it takes time where positions take memory, and hardly any of a file.
  void take_work(std::size_t frames) {
    constexpr std::uint64_t posed_bytes = 16, targets_a_byte = 64;
    std::uint64_t posed = document_.nodes.size() + animation_.channels().size(), displaced = 0;
    for (const Part& part : parts_) {
      posed += joints_of(document_.nodes[static_cast<std::size_t>(part.node)]);
      displaced += part.targets.size() * part.positions.size();
    }
    budget_.take(fmt::format("the poses of {} frames", frames), frames, posed * posed_bytes);
    budget_.take(fmt::format("the morph targets of {} frames", frames), frames, displaced / targets_a_byte);
  }

  void find_parts() {
    for (const int n : tree_.order) {
      const gltf::Node& node = document_.nodes[static_cast<std::size_t>(n)];
      if (node.mesh < 0 || tree_.shown[static_cast<std::size_t>(n)] == 0) continue;
      if (static_cast<std::size_t>(node.mesh) >= document_.meshes.size()) {
        accessors_.fail(fmt::format("mesh {}", node.mesh), fmt::format("fewer than {}", document_.meshes.size()));
      }
      if (node.skin >= 0 && static_cast<std::size_t>(node.skin) >= document_.skins.size()) {
        accessors_.fail(fmt::format("skin {}", node.skin), fmt::format("fewer than {}", document_.skins.size()));
      }
      for (const gltf::Primitive& primitive : document_.meshes[static_cast<std::size_t>(node.mesh)].primitives) {
        if (primitive.mode >= gltf::mode_triangles && primitive.mode <= gltf::mode_fan) add_part(n, node, primitive);
      }
    }
    if (parts_.empty()) accessors_.fail("no triangles", "a mesh");
  }

  void add_part(int n, const gltf::Node& node, const gltf::Primitive& primitive) {
    progress_.check_stop();
    // With the joints' matrices, which are made anew for every part and frame.
    budget_.take("parts", 1, sizeof(Part) + joints_of(node) * sizeof(Eigen::Matrix4d));
    budget_.take("morph targets", primitive.targets.size(), sizeof(std::vector<float>));
    Part part{.node = n, .skin = node.skin, .mesh = node.mesh};
    part.positions = accessors_.floats(attribute(primitive, "POSITION"), 3);
    for (const int target : primitive.targets) {
      // A target that leaves the positions alone stays empty.
      part.targets.push_back(target < 0 ? std::vector<float>() : accessors_.floats(target, 3));
      if (target >= 0) require_count(part.targets.back().size(), part.positions.size());
    }
    if (part.skin >= 0) add_bones(primitive, part);
    add_triangles(primitive, part.vertices());
    if (static_cast<std::int64_t>(part.vertices()) > most_vertices - out_.vertices) {
      accessors_.fail("too many vertices", fmt::format("at most {}", most_vertices));
    }
    out_.vertices += static_cast<int>(part.vertices());
    parts_.push_back(std::move(part));
  }

  std::size_t joints_of(const gltf::Node& node) const {
    return node.skin < 0 ? 0 : document_.skins[static_cast<std::size_t>(node.skin)].joints.size();
  }

  int attribute(const gltf::Primitive& primitive, const std::string& name) const {
    const auto found = primitive.attributes.find(name);
    if (found == primitive.attributes.end()) accessors_.fail("a mesh without " + name, "this attribute");
    return found->second;
  }

  void require_count(std::size_t found, std::size_t expected) const {
    if (found != expected)
      accessors_.fail(fmt::format("an attribute of {} numbers", found), fmt::format("{}", expected));
  }

  void add_bones(const gltf::Primitive& primitive, Part& part) const {
    for (int set = 0; primitive.attributes.contains(fmt::format("JOINTS_{}", set)); ++set) {
      auto joints = accessors_.indices(attribute(primitive, fmt::format("JOINTS_{}", set)), 4);
      auto weights = accessors_.floats(attribute(primitive, fmt::format("WEIGHTS_{}", set)), 4);
      require_count(joints.size(), part.vertices() * 4);
      require_count(weights.size(), part.vertices() * 4);
      const auto& bones = document_.skins[static_cast<std::size_t>(part.skin)].joints;
      for (std::size_t i = 0; i < joints.size(); ++i) {
        if (joints[i] >= bones.size() && weights[i] != 0) {
          accessors_.fail(fmt::format("a vertex on joint {}", joints[i]), fmt::format("fewer than {}", bones.size()));
        }
      }
      part.bones.emplace_back(std::move(joints), std::move(weights));
    }
  }

  void add_triangles(const gltf::Primitive& primitive, std::size_t vertices) {
    std::vector<std::uint32_t> corners;
    if (primitive.indices >= 0) {
      corners = accessors_.indices(primitive.indices, 1);
    } else {
      budget_.take("triangles", vertices, sizeof(std::uint32_t));
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
    const bool strip = primitive.mode == gltf::mode_strip, fan = primitive.mode == gltf::mode_fan;
    const std::size_t step = strip || fan ? 1 : 3;
    budget_.take("triangles", corners.size() / step, sizeof(Triangle));
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

  std::vector<Eigen::Matrix4d> inverse_binds_of(const gltf::Skin& skin) const {
    budget_.take("a skin's matrices", skin.joints.size(), sizeof(Eigen::Matrix4d));
    std::vector<Eigen::Matrix4d> out(skin.joints.size(), Eigen::Matrix4d::Identity());
    for (const int joint : skin.joints) {
      if (joint < 0 || static_cast<std::size_t>(joint) >= document_.nodes.size()) {
        accessors_.fail(fmt::format("a skin with joint {}", joint), "a node of the file");
      }
    }
    if (skin.inverse_binds < 0) return out;
    const std::vector<float> numbers = accessors_.floats(skin.inverse_binds, 16);
    if (numbers.size() < out.size() * 16) accessors_.fail("a skin with fewer matrices than joints", "one for each");
    for (std::size_t j = 0; j < out.size(); ++j) {
      out[j] = Eigen::Map<const Eigen::Matrix4f>(numbers.data() + 16 * j).cast<double>();
    }
    return out;
  }

  void add_frame(double time) {
    GltfPose pose = gltf_pose(document_, animation_, time);
    // Parents come first in the order, so every node meets its parent's finished matrix.
    for (const int n : tree_.order) {
      for (const int child : document_.nodes[static_cast<std::size_t>(n)].children) {
        auto& local = pose.local[static_cast<std::size_t>(child)];
        local = pose.local[static_cast<std::size_t>(n)] * local;
      }
    }
    for (const Part& part : parts_) add_part_positions(part, pose);
  }

  void add_part_positions(const Part& part, const GltfPose& pose) {
    std::vector<float> moved = part.positions;
    const auto& own = pose.weights[static_cast<std::size_t>(part.node)];
    const auto& weights = own.empty() ? document_.meshes[static_cast<std::size_t>(part.mesh)].weights : own;
    for (std::size_t t = 0; t < std::min(part.targets.size(), weights.size()); ++t) {
      if (weights[t] == 0 || part.targets[t].empty()) continue;
      progress_.check_stop();
      for (std::size_t i = 0; i < moved.size(); ++i) {
        moved[i] =
            static_cast<float>(static_cast<double>(moved[i]) + weights[t] * static_cast<double>(part.targets[t][i]));
      }
    }
    std::vector<Eigen::Matrix4d> bones;
    if (part.skin >= 0) {
      const auto& joints = document_.skins[static_cast<std::size_t>(part.skin)].joints;
      for (std::size_t j = 0; j < joints.size(); ++j) {
        bones.push_back(pose.local[static_cast<std::size_t>(joints[j])] *
                        inverse_binds_[static_cast<std::size_t>(part.skin)][j]);
      }
    }
    const Eigen::Matrix4d& still = pose.local[static_cast<std::size_t>(part.node)];
    const bool moves = !still.isIdentity(0);
    for (std::size_t v = 0; v < part.vertices(); ++v) {
      if (v % stop_stride == 0) progress_.check_stop();
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

  const gltf::Document& document_;
  gltf::Accessors accessors_;
  gltf::Budget& budget_;
  const Progress& progress_;
  gltf::NodeTree tree_;
  GltfAnimation animation_;
  std::vector<Part> parts_;
  std::vector<std::vector<Eigen::Matrix4d>> inverse_binds_;
  MeshSequence out_;
};

std::size_t chosen_animation(const gltf::Document& document, const std::string& file, const MeshReadOptions& options) {
  if (!options.animation.empty()) return gltf::find_animation(document, options.animation, file);
  if (document.animations.size() > 1 && options.note) {
    options.note(fmt::format("{}: the first of {} animations is read; --animation takes another by name or number: {}",
                             file, document.animations.size(), gltf::listed_names(document)));
  }
  return 0;
}

}  // namespace

MeshSequence parse_gltf_mesh(std::string_view bytes, const std::filesystem::path& file,
                             const MeshReadOptions& options) {
  const std::string name = file.string();
  gltf::Budget budget(name, bytes.size(), options.most_bytes);
  const gltf::Document document = gltf::read_document(bytes, file, budget, options.progress);
  const std::size_t animation = chosen_animation(document, name, options);
  MeshSequence out = Baker(document, name, budget, options.progress, animation).bake(options.rate_hz);
  require_valid(out, name);
  return out;
}

}  // namespace kinespace
