#include "kinespace/motion/gltf.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/base/printable.h"
#include "kinespace/gltf/arrays.h"
#include "kinespace/gltf/tiny.h"
#include "kinespace/motion/detail/motion_builder.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

constexpr double metres = 0.01;             // in a centimetre
constexpr std::size_t most_joints = 65536;  // a vertex names its joint in 16 bits

// JSON holds UTF-8 only; what a file has else in a name becomes '?'.
std::string utf8(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const CharacterOfText next = first_character(text);
    next.well_formed ? out.append(text.substr(0, next.bytes)) : out.append(1, '?');
    text.remove_prefix(next.bytes);
  }
  return out;
}

[[noreturn]] void fail_too_large(const Clip& clip, const std::string& found) {
  throw Error(ErrorKind::bad_input, {.file = clip.name,
                                     .found = found,
                                     .expected = "a clip that one glTF file can hold",
                                     .remedy = "write it in parts"});
}

// The octahedra, in the rest pose.
class BoneMesh {
 public:
  explicit BoneMesh(const Clip& clip) : rest_(clip.skeleton.joints.size(), Eigen::Vector3d::Zero()) {
    const auto& joints = clip.skeleton.joints;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (joints[j].parent < 0) {
        rest_[j] = joints[j].offset;
        continue;
      }
      const auto parent = static_cast<std::size_t>(joints[j].parent);
      // A joint that travels is not at the end of a bone; one whose track says the same thing all the time is.
      const auto* track = clip.translation_track(static_cast<int>(j));
      const Eigen::Vector3d bone = track != nullptr ? track->values.front() : joints[j].offset;
      rest_[j] = rest_[parent] + bone;
      if (track == nullptr || is_still(*track)) add(parent, bone);
    }
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (joints[j].end_site) add(j, *joints[j].end_site);
    }
    if (joint_of_.empty()) add(0, {0, 2 * shortest, 0});
  }

  [[nodiscard]] const std::vector<Eigen::Vector3d>& rest() const { return rest_; }
  [[nodiscard]] std::span<const float> positions() const { return positions_; }
  [[nodiscard]] std::span<const std::uint32_t> triangles() const { return triangles_; }
  [[nodiscard]] std::span<const std::size_t> joint_of() const { return joint_of_; }  // by vertex

 private:
  static bool is_still(const Clip::TranslationTrack& track) {
    Eigen::Vector3d low = track.values.front(), high = low;
    for (const Eigen::Vector3d& value : track.values) {
      low = low.cwiseMin(value);
      high = high.cwiseMax(value);
    }
    return (high - low).maxCoeff() <= still_cm;
  }

  static constexpr double shortest = 0.5;  // cm: shorter bones would be specks

  void add(std::size_t joint, const Eigen::Vector3d& bone) {
    const double length = bone.norm();
    if (length < shortest) return;
    const Eigen::Vector3d along = bone / length;
    const Eigen::Vector3d side = along.unitOrthogonal() * (0.08 * length);
    const Eigen::Vector3d up = along.cross(side);
    const Eigen::Vector3d waist = bone * 0.2;
    const auto base = static_cast<std::uint32_t>(joint_of_.size());
    for (const Eigen::Vector3d& v : std::array<Eigen::Vector3d, 6>{Eigen::Vector3d::Zero(), waist + side, waist + up,
                                                                   waist - side, waist - up, bone}) {
      for (const double x : (rest_[joint] + v).eval()) positions_.push_back(static_cast<float>(x * metres));
      joint_of_.push_back(joint);
    }
    for (std::uint32_t i = 1; i <= 4; ++i) {
      const std::uint32_t next = i % 4 + 1;
      for (const std::uint32_t v : {0U, next, i, 5U, i, next}) triangles_.push_back(base + v);
    }
  }

  std::vector<Eigen::Vector3d> rest_;
  std::vector<float> positions_;
  std::vector<std::uint32_t> triangles_;
  std::vector<std::size_t> joint_of_;
};

class Writer {
 public:
  explicit Writer(const Clip& clip) : clip_(clip), arrays_(model_) {}

  tinygltf::Model write() && {
    const std::size_t joints = clip_.skeleton.joints.size();
    if (joints > most_joints) fail_too_large(clip_, std::to_string(joints) + " joints");
    model_.asset.version = "2.0";
    model_.asset.generator = "kinespace";
    add_nodes();
    add_mesh();
    add_animation();
    return std::move(model_);
  }

 private:
  static std::vector<double> scaled(const Eigen::Vector3d& v) {
    return {v.x() * metres, v.y() * metres, v.z() * metres};
  }

  void add_nodes() {
    const auto& joints = clip_.skeleton.joints;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const Eigen::Quaterniond q = clip_.rotation(static_cast<int>(j), 0).normalized();
      tinygltf::Node node;
      node.name = utf8(joints[j].name);
      node.translation = scaled(clip_.translation(static_cast<int>(j), 0));
      node.rotation = {q.x(), q.y(), q.z(), q.w()};
      model_.nodes.push_back(std::move(node));
      if (joints[j].parent >= 0) {
        model_.nodes[static_cast<std::size_t>(joints[j].parent)].children.push_back(static_cast<int>(j));
      }
    }
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (!joints[j].end_site) continue;
      tinygltf::Node node;
      node.name = utf8(joints[j].name) + " end";
      node.translation = scaled(*joints[j].end_site);
      model_.nodes[j].children.push_back(static_cast<int>(model_.nodes.size()));
      model_.nodes.push_back(std::move(node));
    }
    tinygltf::Scene scene;
    scene.nodes = {0};
    model_.scenes.push_back(std::move(scene));
    model_.defaultScene = 0;
  }

  template <typename Index>
  int add_joint_indices(const BoneMesh& mesh, int component) {
    std::vector<Index> indices;
    for (const std::size_t joint : mesh.joint_of()) indices.insert(indices.end(), {static_cast<Index>(joint), 0, 0, 0});
    return arrays_.add(std::span<const Index>(indices), component, TINYGLTF_TYPE_VEC4, mesh.joint_of().size(),
                       TINYGLTF_TARGET_ARRAY_BUFFER);
  }

  int add_triangles(const BoneMesh& mesh) {
    constexpr int target = TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER;
    const auto triangles = mesh.triangles();
    if (mesh.joint_of().size() > 65535) {
      return arrays_.add(triangles, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR, triangles.size(),
                         target);
    }
    const std::vector<std::uint16_t> narrow(triangles.begin(), triangles.end());
    return arrays_.add(std::span<const std::uint16_t>(narrow), TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                       TINYGLTF_TYPE_SCALAR, narrow.size(), target);
  }

  void add_mesh() {
    const BoneMesh mesh(clip_);
    const bool few = clip_.skeleton.joints.size() <= 256;
    std::vector<std::uint8_t> weights;
    for (std::size_t v = 0; v < mesh.joint_of().size(); ++v) weights.insert(weights.end(), {255, 0, 0, 0});
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.indices = add_triangles(mesh);
    primitive.material = 0;
    primitive.attributes["POSITION"] =
        arrays_.add_ranged(mesh.positions(), TINYGLTF_TYPE_VEC3, 3, TINYGLTF_TARGET_ARRAY_BUFFER);
    primitive.attributes["JOINTS_0"] =
        few ? add_joint_indices<std::uint8_t>(mesh, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE)
            : add_joint_indices<std::uint16_t>(mesh, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT);
    primitive.attributes["WEIGHTS_0"] =
        arrays_.add(std::span<const std::uint8_t>(weights), TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_TYPE_VEC4,
                    mesh.joint_of().size(), TINYGLTF_TARGET_ARRAY_BUFFER);
    model_.accessors.back().normalized = true;
    tinygltf::Mesh bones;
    bones.name = "bones";
    bones.primitives.push_back(std::move(primitive));
    model_.meshes.push_back(std::move(bones));
    tinygltf::Material material;
    material.pbrMetallicRoughness.baseColorFactor = {0.85, 0.75, 0.55, 1};
    material.pbrMetallicRoughness.metallicFactor = 0;
    material.pbrMetallicRoughness.roughnessFactor = 0.8;
    model_.materials.push_back(std::move(material));
    add_skin(mesh.rest());
    tinygltf::Node node;
    node.name = "bones";
    node.mesh = 0;
    node.skin = 0;
    model_.scenes[0].nodes.push_back(static_cast<int>(model_.nodes.size()));
    model_.nodes.push_back(std::move(node));
  }

  void add_skin(const std::vector<Eigen::Vector3d>& rest) {
    tinygltf::Skin skin;
    std::vector<float> inverse;  // columns of 4 x 4 matrices: the rest pose has no rotation
    for (std::size_t j = 0; j < rest.size(); ++j) {
      skin.joints.push_back(static_cast<int>(j));
      const Eigen::Vector3f t = (-rest[j] * metres).cast<float>();
      inverse.insert(inverse.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, t.x(), t.y(), t.z(), 1});
    }
    skin.inverseBindMatrices = arrays_.add_floats(inverse, TINYGLTF_TYPE_MAT4, 16);
    skin.skeleton = 0;
    model_.skins.push_back(std::move(skin));
  }

  int add_times() {
    std::vector<float> times(static_cast<std::size_t>(clip_.frames));
    for (int f = 0; f < clip_.frames; ++f) {
      const auto i = static_cast<std::size_t>(f);
      times[i] = static_cast<float>(f / clip_.rate_hz);
      if (f > 0 && !(times[i] > times[i - 1])) fail_too_large(clip_, std::to_string(clip_.frames) + " frames");
    }
    return arrays_.add_ranged(times, TINYGLTF_TYPE_SCALAR, 1);
  }

  bool turns(int joint) const {
    const auto track = clip_.rotation_track(joint);
    for (std::size_t i = 4; i < track.size(); ++i) {
      if (track[i] != track[i - 4]) return true;
    }
    return false;
  }

  int add_rotations(int joint) {
    std::vector<float> out;
    out.reserve(static_cast<std::size_t>(clip_.frames) * 4);
    Eigen::Quaterniond before = clip_.rotation(joint, 0);
    for (int f = 0; f < clip_.frames; ++f) {
      Eigen::Quaterniond q = clip_.rotation(joint, f).normalized();
      if (q.dot(before) < 0) q.coeffs() = -q.coeffs();
      for (const double x : q.coeffs()) out.push_back(static_cast<float>(x));
      before = q;
    }
    return arrays_.add_floats(out, TINYGLTF_TYPE_VEC4, 4);
  }

  int add_translations(const Clip::TranslationTrack& track) {
    std::vector<float> out;
    out.reserve(track.values.size() * 3);
    for (const Eigen::Vector3d& value : track.values) {
      for (const double x : value) out.push_back(static_cast<float>(x * metres));
    }
    return arrays_.add_floats(out, TINYGLTF_TYPE_VEC3, 3);
  }

  void add_channel(tinygltf::Animation& animation, int times, int values, int joint, const char* path) const {
    tinygltf::AnimationSampler sampler;
    sampler.input = times;
    sampler.output = values;
    sampler.interpolation = "LINEAR";
    tinygltf::AnimationChannel channel;
    channel.sampler = static_cast<int>(animation.samplers.size());
    channel.target_node = joint;
    channel.target_path = path;
    animation.samplers.push_back(std::move(sampler));
    animation.channels.push_back(std::move(channel));
  }

  void add_animation() {
    constexpr double largest = 2e9;
    const double bytes = static_cast<double>(clip_.frames) * (4 + 16.0 * clip_.skeleton.joint_count() +
                                                              12 * static_cast<double>(clip_.translations.size()));
    if (bytes > largest) fail_too_large(clip_, std::to_string(clip_.frames) + " frames");
    const int times = add_times();
    tinygltf::Animation animation;
    animation.name = utf8(clip_.name);
    for (int j = 0; j < clip_.skeleton.joint_count(); ++j) {
      if (j == 0 || turns(j)) add_channel(animation, times, add_rotations(j), j, "rotation");
      if (const auto* track = clip_.translation_track(j)) {
        add_channel(animation, times, add_translations(*track), j, "translation");
      }
    }
    model_.animations.push_back(std::move(animation));
  }

  const Clip& clip_;
  tinygltf::Model model_;
  GltfArrays arrays_;
};

}  // namespace

std::string format_gltf(const Clip& clip, GltfForm form) {
  const tinygltf::Model model = Writer(clip).write();
  std::ostringstream out;
  tinygltf::TinyGLTF().WriteGltfSceneToStream(&model, out, false, form == GltfForm::binary);
  return std::move(out).str();
}

void write_gltf(const std::filesystem::path& path, const Clip& clip) {
  const bool binary = same_word(path.extension().string(), ".glb");
  write_file_atomically(path, format_gltf(clip, binary ? GltfForm::binary : GltfForm::text));
}

}  // namespace kinespace
