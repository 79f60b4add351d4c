// How much memory a glTF file may ask for: a few bytes of it can stand for any amount (sparse accessors, one accessor
// used a thousand times, long animations), so everything that is made from it is counted before it is made.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace kinespace::gltf {

class Budget {
 public:
  // 64 times the file and 256 MiB, all that is decoded taken together: honest files stay below, but for long animations
  // of large skinned meshes. `most_bytes`: that many instead.
  static constexpr std::uint64_t times_file = 64, beyond = std::uint64_t{256} << 20;

  // `remedy`: what to do where it does not suffice.
  Budget(std::string file, std::uint64_t file_bytes, std::optional<std::uint64_t> most_bytes = {},
         std::string remedy = "allow more (--max-memory) if the file is to be trusted")
      : file_(std::move(file)), file_bytes_(file_bytes), chosen_(most_bytes), remedy_(std::move(remedy)) {}

  // `count` things of `size` bytes, of which `what` tells in the message. Throws Error{bad_input} when that is more
  // than what is left.
  void take(std::string_view what, std::uint64_t count, std::uint64_t size);
  // Another file that belongs to the first.
  void add_file(std::uint64_t bytes) { file_bytes_ += bytes; }

  [[nodiscard]] std::uint64_t taken() const { return taken_; }
  [[nodiscard]] std::uint64_t most() const { return chosen_.value_or(file_bytes_ * times_file + beyond); }

 private:
  std::string file_;
  std::uint64_t file_bytes_;
  std::optional<std::uint64_t> chosen_;
  std::string remedy_;
  std::uint64_t taken_ = 0;
};

}  // namespace kinespace::gltf
