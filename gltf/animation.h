// The animations of a glTF file: what their samplers say at a time, and which one is meant.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/gltf/accessors.h"
#include "kinespace/gltf/document.h"

namespace kinespace::gltf {

// One sampler with what it drives.
struct AnimatedValue {
  using Path = Animation::Path;
  using Interpolation = Animation::Interpolation;
  int node = -1;
  Path path = Path::translation;
  Interpolation interpolation = Interpolation::linear;
  std::vector<float> times;   // s, ascending, at least one
  std::vector<float> values;  // `width` for each time, three times that for cubic splines
  std::size_t width = 0;

  // The value at a time, held before the first and after the last; rotations are x, y, z, w, not always of length 1.
  [[nodiscard]] std::vector<double> at(double time) const;

  // The value itself, without its tangents, at a key.
  [[nodiscard]] std::span<const float> key(std::size_t i) const;
  // The largest difference between keys in any number; 0 for a single one.
  [[nodiscard]] double range() const;
};

// The channels of one animation. Throws Error{bad_input} for what does not fit together.
[[nodiscard]] std::vector<AnimatedValue> animated_values(const Document& document, const Animation& animation,
                                                         const Accessors& accessors);

// The rate of times that are evenly spaced to within a hundredth of a step and what 32-bit floats blur; 0 when they are
// not, or lie more than half an hour apart, or there are fewer than two. Of the rates that the floats could stand for, the one of the fewest decimals.
[[nodiscard]] double even_rate(std::span<const float> times);

// What animations are called: their names; "2" for a second one without a name, "walk (2)" for the second walk. Slashes
// and control characters are '_', as the names become parts of names of clips and files.
[[nodiscard]] std::vector<std::string> animation_names(const Document& document);

// The same for a message: separated by commas, cut off behind the twentieth.
[[nodiscard]] std::string listed_names(const Document& document);

// The index of the animation that is called so, or whose number from 1 it is. Throws Error{bad_input} naming those that
// there are.
[[nodiscard]] std::size_t find_animation(const Document& document, std::string_view name_or_number,
                                         const std::string& file);

}  // namespace kinespace::gltf
