// The poses of a glTF scene over time: matrices of nodes and weights of morph targets.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "kinespace/gltf/accessors.h"
#include "kinespace/gltf/animation.h"

namespace kinespace {

class GltfAnimation {
 public:
  // The animation of that index; empty when the file has none such.
  GltfAnimation(const gltf::Document& document, const gltf::Accessors& accessors, std::size_t index);

  [[nodiscard]] const std::vector<gltf::AnimatedValue>& channels() const { return channels_; }
  // When to look: at the times that all channels share when these are evenly spaced and no rate is wanted, else from
  // the first to the last time at the rate. One time, 0, without an animation.
  struct Times {
    std::vector<double> at;
    double rate_hz;
  };
  [[nodiscard]] Times times(std::optional<double> rate_hz, const gltf::Accessors& accessors) const;

 private:
  std::vector<gltf::AnimatedValue> channels_;
};

// Every node relative to its parent. `weights` may be empty for a node.
struct GltfPose {
  std::vector<Eigen::Matrix4d> local;
  std::vector<std::vector<double>> weights;
};
[[nodiscard]] GltfPose gltf_pose(const gltf::Document& document, const GltfAnimation& animation, double time);

}  // namespace kinespace
