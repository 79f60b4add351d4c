#include "kinespace/gltf/animation.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace::gltf {
namespace {

std::vector<double> blended(const AnimatedValue& c, std::size_t i, double t) {
  std::vector<double> out(c.width);
  const auto value = [&](std::size_t key, std::size_t k) { return static_cast<double>(c.values[key * c.width + k]); };
  if (c.path == AnimatedValue::Path::rotation) {
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
std::vector<double> on_spline(const AnimatedValue& c, std::size_t i, double t, double span) {
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

bool ascending(const std::vector<float>& times) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i]) || (i > 0 && !(times[i] > times[i - 1]))) return false;
  }
  return !times.empty();
}

AnimatedValue value_of(const Document& document, const Animation& animation, const Animation::Channel& from,
                       const Accessors& accessors) {
  if (static_cast<std::size_t>(from.node) >= document.nodes.size()) {
    accessors.fail(fmt::format("an animation of node {}", from.node), "a node of the file");
  }
  if (from.sampler < 0 || static_cast<std::size_t>(from.sampler) >= animation.samplers.size()) {
    accessors.fail(fmt::format("animation sampler {}", from.sampler),
                   fmt::format("fewer than {}", animation.samplers.size()));
  }
  const Animation::Sampler& sampler = animation.samplers[static_cast<std::size_t>(from.sampler)];
  AnimatedValue out{.node = from.node, .path = from.path, .interpolation = sampler.interpolation};
  const bool spline = out.interpolation == AnimatedValue::Interpolation::cubic;
  out.times = accessors.floats(sampler.input, 1);
  const int width = out.path == AnimatedValue::Path::rotation ? 4 : out.path == AnimatedValue::Path::weights ? 1 : 3;
  out.values = accessors.floats(sampler.output, width);
  const std::size_t keys = out.times.size() * (spline ? 3 : 1);
  if (!ascending(out.times) || keys == 0 || out.values.size() % keys != 0 || out.values.empty()) {
    accessors.fail("an animation whose times and values do not match", "ascending times and as many values");
  }
  out.width = out.values.size() / keys;
  if (out.path != AnimatedValue::Path::weights && out.width != static_cast<std::size_t>(width)) {
    accessors.fail("an animation with more values than times", "one for each time");
  }
  return out;
}

// The number of the fewest decimals that is within `error` of the rate.
double simplest(double rate, double error) {
  double scale = 1;
  for (int decimals = 0; decimals <= 6; ++decimals, scale *= 10) {
    const double rounded = std::round(rate * scale) / scale;
    if (rounded > 0 && std::abs(rounded - rate) <= error) return rounded;
  }
  return rate;
}

}  // namespace

std::vector<double> AnimatedValue::at(double time) const {
  const auto after = std::upper_bound(times.begin(), times.end(), time,
                                      [](double t, float key) { return t < static_cast<double>(key); });
  const auto next = static_cast<std::size_t>(after - times.begin());
  const std::size_t i = next == 0 ? 0 : next - 1;
  const bool held = next == 0 || next == times.size() || interpolation == Interpolation::step;
  if (held) {
    const auto value = key(i);
    return {value.begin(), value.end()};
  }
  const double from = static_cast<double>(times[i]), span = static_cast<double>(times[i + 1]) - from;
  const double t = (time - from) / span;
  return interpolation == Interpolation::cubic ? on_spline(*this, i, t, span) : blended(*this, i, t);
}

std::span<const float> AnimatedValue::key(std::size_t i) const {
  const std::size_t at = interpolation == Interpolation::cubic ? 3 * i + 1 : i;
  return std::span(values).subspan(at * width, width);
}

double AnimatedValue::range() const {
  double out = 0;
  for (std::size_t k = 0; k < width; ++k) {
    float low = key(0)[k], high = low;
    for (std::size_t i = 1; i < times.size(); ++i) {
      low = std::min(low, key(i)[k]);
      high = std::max(high, key(i)[k]);
    }
    out = std::max(out, static_cast<double>(high) - static_cast<double>(low));
  }
  return out;
}

std::vector<AnimatedValue> animated_values(const Document& document, const Animation& animation,
                                           const Accessors& accessors) {
  accessors.budget().take("animation channels", animation.channels.size(), 2 * sizeof(AnimatedValue));
  std::vector<AnimatedValue> out;
  for (const Animation::Channel& channel : animation.channels) {
    out.push_back(value_of(document, animation, channel, accessors));
  }
  return out;
}

double even_rate(std::span<const float> times) {
  if (times.size() < 2) return 0;
  const double first = static_cast<double>(times.front()), last = static_cast<double>(times.back());
  const double step = (last - first) / static_cast<double>(times.size() - 1);
  const double blur =
      std::max(std::abs(first), std::abs(last)) * static_cast<double>(std::numeric_limits<float>::epsilon());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double off = std::abs(static_cast<double>(times[i]) - first - static_cast<double>(i) * step);
    if (off > 0.01 * step + blur) return 0;
  }
  constexpr double least_rate_hz = 0.0005;  // keys so far apart are no frames
  return 1 / step < least_rate_hz ? 0 : simplest(1 / step, 1 / step * 2 * blur / (last - first));
}

std::vector<std::string> animation_names(const Document& document) {
  std::vector<std::string> out;
  std::map<std::string, int> seen;
  for (std::size_t i = 0; i < document.animations.size(); ++i) {
    std::string name = document.animations[i].name;
    for (char& c : name) {
      if (c == '/' || c == '\\' || static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '_';
    }
    if (name.empty()) name = fmt::format("{}", i + 1);
    const int before = seen[name]++;
    out.push_back(before == 0 ? name : fmt::format("{} ({})", name, before + 1));
  }
  return out;
}

std::string listed_names(const Document& document) {
  constexpr std::size_t most = 20;
  const std::vector<std::string> names = animation_names(document);
  std::string out = fmt::format("{}", fmt::join(std::span(names).first(std::min(most, names.size())), ", "));
  if (names.size() > most) out += ", ...";
  return out;
}

std::size_t find_animation(const Document& document, std::string_view name_or_number, const std::string& file) {
  const std::vector<std::string> names = animation_names(document);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name_or_number || document.animations[i].name == name_or_number) return i;
  }
  std::size_t number = 0;
  const char* const end = name_or_number.data() + name_or_number.size();
  const auto [stop, code] = std::from_chars(name_or_number.data(), end, number);
  if (code == std::errc() && stop == end && number >= 1 && number <= names.size()) return number - 1;
  throw Error(ErrorKind::bad_input, {.file = file,
                                     .found = fmt::format("no animation \"{}\"", name_or_number),
                                     .expected = names.empty() ? "a file with animations"
                                                               : fmt::format("a number from 1 to {} or a name: {}",
                                                                             names.size(), listed_names(document))});
}

}  // namespace kinespace::gltf
