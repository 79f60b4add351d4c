// What every glTF writer does with arrays of numbers: appends them to the file's buffer and says where they are.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

#include "kinespace/gltf/tiny.h"

namespace kinespace {

// The numbers of a file to write, one buffer view and accessor an array.
class GltfArrays {
 public:
  explicit GltfArrays(tinygltf::Model& model) : model_(model) { model_.buffers.emplace_back(); }

  template <typename T>
  int add(std::span<const T> values, int component, int type, std::size_t count, int target = 0) {
    auto& data = model_.buffers[0].data;
    data.resize((data.size() + 3) / 4 * 4);
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = data.size();
    view.byteLength = values.size_bytes();
    view.target = target;
    const auto* raw = reinterpret_cast<const unsigned char*>(values.data());
    data.insert(data.end(), raw, raw + values.size_bytes());
    model_.bufferViews.push_back(std::move(view));
    tinygltf::Accessor accessor;
    accessor.bufferView = static_cast<int>(model_.bufferViews.size()) - 1;
    accessor.componentType = component;
    accessor.type = type;
    accessor.count = count;
    model_.accessors.push_back(std::move(accessor));
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  int add_floats(std::span<const float> values, int type, std::size_t width, int target = 0) {
    return add(values, TINYGLTF_COMPONENT_TYPE_FLOAT, type, values.size() / width, target);
  }

  // The format wants the range of positions and of times.
  int add_ranged(std::span<const float> values, int type, std::size_t width, int target = 0) {
    const int index = add_floats(values, type, width, target);
    auto& accessor = model_.accessors[static_cast<std::size_t>(index)];
    for (std::size_t c = 0; c < width; ++c) {
      float low = values[c], high = values[c];
      for (std::size_t i = c; i < values.size(); i += width) {
        low = std::min(low, values[i]);
        high = std::max(high, values[i]);
      }
      accessor.minValues.push_back(static_cast<double>(low));
      accessor.maxValues.push_back(static_cast<double>(high));
    }
    return index;
  }

 private:
  tinygltf::Model& model_;
};

}  // namespace kinespace
