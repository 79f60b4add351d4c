// The poses of a glTF scene over time: matrices of nodes and weights of morph targets.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "kinespace/gltf/accessors.h"

namespace kinespace {

// One sampler with what it drives.
struct GltfChannel {
  using Path = gltf::Animation::Path;
  using Interpolation = gltf::Animation::Interpolation;
  int node = -1;
  Path path = Path::translation;
  Interpolation interpolation = Interpolation::linear;
  std::vector<float> times;   // s, ascending, at least one
  std::vector<float> values;  // `width` for each time, three times that for cubic splines
  std::size_t width = 0;

  // The value at a time, held before the first and after the last; rotations are unit quaternions x, y, z, w.
  [[nodiscard]] std::vector<double> at(double time) const;
};

class GltfAnimation {
 public:
  // The first animation of the file; empty when it has none.
  GltfAnimation(const gltf::Document& document, const gltf::Accessors& accessors);

  [[nodiscard]] const std::vector<GltfChannel>& channels() const { return channels_; }
  // When to look: at the times that all channels share when these are evenly spaced and no rate is wanted, else from
  // the first to the last time at the rate. One time, 0, without an animation.
  struct Times {
    std::vector<double> at;
    double rate_hz;
  };
  [[nodiscard]] Times times(std::optional<double> rate_hz, const gltf::Accessors& accessors) const;

 private:
  std::vector<GltfChannel> channels_;
};

// Every node relative to its parent. `weights` may be empty for a node.
struct GltfPose {
  std::vector<Eigen::Matrix4d> local;
  std::vector<std::vector<double>> weights;
};
[[nodiscard]] GltfPose gltf_pose(const gltf::Document& document, const GltfAnimation& animation, double time);

// Every node once, parents first. Throws Error{bad_input} for a node that is its own ancestor or has two parents.
[[nodiscard]] std::vector<int> gltf_order(const gltf::Document& document, const gltf::Accessors& accessors);

}  // namespace kinespace
