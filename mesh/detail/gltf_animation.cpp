#include "kinespace/mesh/detail/gltf_animation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {
namespace {

constexpr std::size_t most_frames = 1'000'000;

std::vector<double> blended(const GltfChannel& c, std::size_t i, double t) {
  std::vector<double> out(c.width);
  const auto value = [&](std::size_t key, std::size_t k) { return static_cast<double>(c.values[key * c.width + k]); };
  if (c.path == GltfChannel::Path::rotation) {
    const auto rotation = [&](std::size_t key) {
      return Eigen::Quaterniond(value(key, 3), value(key, 0), value(key, 1), value(key, 2)).normalized();
    };
    const Eigen::Quaterniond q = rotation(i).slerp(t, rotation(i + 1));
    return {q.x(), q.y(), q.z(), q.w()};
  }
  for (std::size_t k = 0; k < c.width; ++k) out[k] = (1 - t) * value(i, k) + t * value(i + 1, k);
  return out;
}

// Hermite splines as the specification has them (glTF 2.0, appendix C.5): in-tangent, value, out-tangent for each time.
std::vector<double> on_spline(const GltfChannel& c, std::size_t i, double t, double span) {
  std::vector<double> out(c.width);
  const auto value = [&](std::size_t key, std::size_t part, std::size_t k) {
    return static_cast<double>(c.values[(3 * key + part) * c.width + k]);
  };
  const double t2 = t * t, t3 = t2 * t;
  for (std::size_t k = 0; k < c.width; ++k) {
    out[k] = (2 * t3 - 3 * t2 + 1) * value(i, 1, k) + span * (t3 - 2 * t2 + t) * value(i, 2, k) +
             (3 * t2 - 2 * t3) * value(i + 1, 1, k) + span * (t3 - t2) * value(i + 1, 0, k);
  }
  return out;
}

GltfChannel channel_of(const gltf::Document& document, const gltf::Animation& animation,
                       const gltf::Animation::Channel& from, const gltf::Accessors& accessors) {
  if (static_cast<std::size_t>(from.node) >= document.nodes.size()) {
    accessors.fail(fmt::format("an animation of node {}", from.node), "a node of the file");
  }
  if (from.sampler < 0 || static_cast<std::size_t>(from.sampler) >= animation.samplers.size()) {
    accessors.fail(fmt::format("animation sampler {}", from.sampler),
                   fmt::format("fewer than {}", animation.samplers.size()));
  }
  const gltf::Animation::Sampler& sampler = animation.samplers[static_cast<std::size_t>(from.sampler)];
  GltfChannel out;
  out.node = from.node;
  out.interpolation = sampler.interpolation;
  out.path = from.path;
  const bool spline = out.interpolation == GltfChannel::Interpolation::cubic;
  out.times = accessors.floats(sampler.input, 1);
  const int width = out.path == GltfChannel::Path::rotation ? 4 : out.path == GltfChannel::Path::weights ? 1 : 3;
  out.values = accessors.floats(sampler.output, width);
  const std::size_t keys = out.times.size() * (spline ? 3 : 1);
  bool ascending = !out.times.empty();
  for (std::size_t i = 0; i < out.times.size(); ++i) {
    ascending = ascending && std::isfinite(out.times[i]) && (i == 0 || out.times[i] > out.times[i - 1]);
  }
  if (!ascending || keys == 0 || out.values.size() % keys != 0 || out.values.empty()) {
    accessors.fail("an animation whose times and values do not match", "ascending times and as many values");
  }
  out.width = out.values.size() / keys;
  if (out.path != GltfChannel::Path::weights && out.width != static_cast<std::size_t>(width)) {
    accessors.fail("an animation with more values than times", "one for each time");
  }
  return out;
}

// 0 when they are not.
double rate_of_even(const std::vector<float>& times) {
  if (times.size() < 2) return 0;
  const double first = static_cast<double>(times.front()), last = static_cast<double>(times.back());
  const double step = (last - first) / static_cast<double>(times.size() - 1);
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (std::abs(static_cast<double>(times[i]) - first - static_cast<double>(i) * step) > 0.01 * step) return 0;
  }
  return std::round(1000 / step) / 1000;  // what 32-bit times blurred
}

Eigen::Matrix4d local_of(const gltf::Placement& node) {
  if (node.matrix) return Eigen::Map<const Eigen::Matrix4d>(node.matrix->data());
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  out.translate(Eigen::Map<const Eigen::Vector3d>(node.translation.data()));
  const auto& q = node.rotation;
  out.rotate(Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized());
  out.scale(Eigen::Map<const Eigen::Vector3d>(node.scale.data()));
  return out.matrix();
}

void apply(const GltfChannel& channel, double time, gltf::Placement& node) {
  std::vector<double> value = channel.at(time);
  switch (channel.path) {
    case GltfChannel::Path::translation:
      std::copy_n(value.begin(), 3, node.translation.begin());
      break;
    case GltfChannel::Path::rotation:
      std::copy_n(value.begin(), 4, node.rotation.begin());
      break;
    case GltfChannel::Path::scale:
      std::copy_n(value.begin(), 3, node.scale.begin());
      break;
    case GltfChannel::Path::weights:
      node.weights = std::move(value);
      break;
  }
}

}  // namespace

std::vector<double> GltfChannel::at(double time) const {
  const auto after = std::upper_bound(times.begin(), times.end(), time,
                                      [](double t, float key) { return t < static_cast<double>(key); });
  const auto next = static_cast<std::size_t>(after - times.begin());
  const std::size_t i = next == 0 ? 0 : next - 1;
  const bool held = next == 0 || next == times.size() || interpolation == Interpolation::step;
  if (held) {
    const std::size_t key = interpolation == Interpolation::cubic ? 3 * i + 1 : i;
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(key * width);
    return {first, first + static_cast<std::ptrdiff_t>(width)};
  }
  const double from = static_cast<double>(times[i]), span = static_cast<double>(times[i + 1]) - from;
  const double t = (time - from) / span;
  return interpolation == Interpolation::cubic ? on_spline(*this, i, t, span) : blended(*this, i, t);
}

GltfAnimation::GltfAnimation(const gltf::Document& document, const gltf::Accessors& accessors) {
  if (document.animations.empty()) return;
  const gltf::Animation& animation = document.animations.front();
  accessors.budget().take("animation channels", animation.channels.size(), 2 * sizeof(GltfChannel));
  for (const gltf::Animation::Channel& channel : animation.channels) {
    channels_.push_back(channel_of(document, animation, channel, accessors));
  }
}

GltfAnimation::Times GltfAnimation::times(std::optional<double> rate_hz, const gltf::Accessors& accessors) const {
  if (channels_.empty()) return {{0.0}, rate_hz.value_or(MeshSequence::usual_rate_hz)};
  bool shared = true;
  double first = static_cast<double>(channels_[0].times.front()), last = static_cast<double>(channels_[0].times.back());
  for (const GltfChannel& c : channels_) {
    shared = shared && c.times == channels_[0].times;
    first = std::min(first, static_cast<double>(c.times.front()));
    last = std::max(last, static_cast<double>(c.times.back()));
  }
  const double even = shared && !rate_hz ? rate_of_even(channels_[0].times) : 0;
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
  for (const GltfChannel& channel : animation.channels()) {
    apply(channel, time, posed[static_cast<std::size_t>(channel.node)]);
  }
  GltfPose out;
  for (gltf::Placement& node : posed) {
    out.local.push_back(local_of(node));
    out.weights.push_back(std::move(node.weights));
  }
  return out;
}

std::vector<int> gltf_order(const gltf::Document& document, const gltf::Accessors& accessors) {
  std::vector<int> parent(document.nodes.size(), -1), out;
  for (std::size_t n = 0; n < document.nodes.size(); ++n) {
    for (const int child : document.nodes[n].children) {
      const bool good = child >= 0 && static_cast<std::size_t>(child) < document.nodes.size() &&
                        parent[static_cast<std::size_t>(child)] < 0;
      if (!good) accessors.fail(fmt::format("node {} has child {}", n, child), "a node of the file with one parent");
      parent[static_cast<std::size_t>(child)] = static_cast<int>(n);
    }
  }
  for (std::size_t n = 0; n < parent.size(); ++n) {
    if (parent[n] < 0) out.push_back(static_cast<int>(n));
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto& children = document.nodes[static_cast<std::size_t>(out[i])].children;
    out.insert(out.end(), children.begin(), children.end());
  }
  if (out.size() != parent.size()) accessors.fail("nodes that are their own ancestors", "a tree");
  return out;
}

}  // namespace kinespace
