#include "kinespace/mesh/detail/gltf_animation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {
namespace {

constexpr std::size_t most_frames = 1'000'000;

Eigen::Matrix4d local_of(const gltf::Placement& node) {
  if (node.matrix) return Eigen::Map<const Eigen::Matrix4d>(node.matrix->data());
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  out.translate(Eigen::Map<const Eigen::Vector3d>(node.translation.data()));
  const auto& q = node.rotation;
  out.rotate(Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized());
  out.scale(Eigen::Map<const Eigen::Vector3d>(node.scale.data()));
  return out.matrix();
}

void apply(const gltf::AnimatedValue& channel, double time, gltf::Placement& node) {
  std::vector<double> value = channel.at(time);
  switch (channel.path) {
    case gltf::AnimatedValue::Path::translation:
      std::copy_n(value.begin(), 3, node.translation.begin());
      break;
    case gltf::AnimatedValue::Path::rotation:
      std::copy_n(value.begin(), 4, node.rotation.begin());
      break;
    case gltf::AnimatedValue::Path::scale:
      std::copy_n(value.begin(), 3, node.scale.begin());
      break;
    case gltf::AnimatedValue::Path::weights:
      node.weights = std::move(value);
      break;
  }
}

}  // namespace

GltfAnimation::GltfAnimation(const gltf::Document& document, const gltf::Accessors& accessors, std::size_t index) {
  if (index < document.animations.size()) {
    channels_ = gltf::animated_values(document, document.animations[index], accessors);
  }
}

GltfAnimation::Times GltfAnimation::times(std::optional<double> rate_hz, const gltf::Accessors& accessors) const {
  if (channels_.empty()) return {{0.0}, rate_hz.value_or(MeshSequence::usual_rate_hz)};
  bool shared = true;
  double first = static_cast<double>(channels_[0].times.front()), last = static_cast<double>(channels_[0].times.back());
  for (const gltf::AnimatedValue& c : channels_) {
    shared = shared && c.times == channels_[0].times;
    first = std::min(first, static_cast<double>(c.times.front()));
    last = std::max(last, static_cast<double>(c.times.back()));
  }
  const double even = shared && !rate_hz ? gltf::even_rate(channels_[0].times) : 0;
  if (even > 0) return {{channels_[0].times.begin(), channels_[0].times.end()}, even};
  Times out{{}, rate_hz.value_or(MeshSequence::usual_rate_hz)};
  const double frames = std::floor((last - first) * out.rate_hz + 0.5) + 1;
  if (!(frames <= static_cast<double>(most_frames))) {
    accessors.fail(fmt::format("an animation of {} s", last - first), fmt::format("at most {} frames", most_frames),
                   "give a lower rate");
  }
  accessors.budget().take("frames", static_cast<std::uint64_t>(frames), sizeof(double));
  for (std::size_t f = 0; f < static_cast<std::size_t>(frames); ++f) {
    out.at.push_back(std::min(first + static_cast<double>(f) / out.rate_hz, last));
  }
  return out;
}

GltfPose gltf_pose(const gltf::Document& document, const GltfAnimation& animation, double time) {
  std::vector<gltf::Placement> posed;
  posed.reserve(document.nodes.size());
  for (const gltf::Node& node : document.nodes) posed.push_back(node.rest);
  for (const gltf::AnimatedValue& channel : animation.channels()) {
    apply(channel, time, posed[static_cast<std::size_t>(channel.node)]);
  }
  GltfPose out;
  for (gltf::Placement& node : posed) {
    out.local.push_back(local_of(node));
    out.weights.push_back(std::move(node.weights));
  }
  return out;
}

}  // namespace kinespace
