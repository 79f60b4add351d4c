// Numbers out of the buffers of a glTF file, every offset and count checked first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "kinespace/gltf/budget.h"
#include "kinespace/gltf/document.h"

namespace kinespace::gltf {

class Accessors {
 public:
  // What is read is taken from the budget. All three must outlive this.
  Accessors(const Document& document, const std::string& file, Budget& budget);

  // The numbers of an accessor with `width` components an element; integers as they are, or scaled when normalised.
  // Throws Error{bad_input} when there is no such accessor, it has another width, or it reaches beyond its buffer.
  [[nodiscard]] std::vector<float> floats(int accessor, int width) const;
  [[nodiscard]] std::vector<std::uint32_t> indices(int accessor, int width) const;

  [[noreturn]] void fail(std::string found, std::string expected, std::string remedy = {}) const;
  [[nodiscard]] Budget& budget() const { return budget_; }

 private:
  struct View {
    const unsigned char* data;
    std::size_t stride;
    std::size_t count;
    int component;
  };
  [[nodiscard]] View view_of(int buffer_view, std::uint64_t offset, std::uint64_t count, int component,
                             int width) const;
  [[nodiscard]] std::size_t count_of(int accessor, int width) const;
  template <typename T>
  void read(int accessor, int width, std::vector<T>& out) const;

  const Document& document_;
  const std::string& file_;
  Budget& budget_;
  std::uint64_t most_count_ = 0;  // of the accessors with data behind them
};

}  // namespace kinespace::gltf
