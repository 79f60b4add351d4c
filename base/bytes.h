// Little-endian reading and writing of plain values, with every length checked before it is believed.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "kinespace/base/error.h"

namespace kinespace {

static_assert(std::endian::native == std::endian::little,
              "the formats are little-endian; port ByteWriter and ByteReader");

using Bytes = std::vector<std::byte>;

class ByteWriter {
 public:
  template <typename T>
  requires std::is_arithmetic_v<T>
  void put(T value) {
    const auto* raw = reinterpret_cast<const std::byte*>(&value);
    bytes_.insert(bytes_.end(), raw, raw + sizeof value);
  }
  template <typename T>
  requires std::is_arithmetic_v<T>
  void put_array(std::span<const T> values) { put_bytes(std::as_bytes(values)); }
  void put_bytes(std::span<const std::byte> raw) { bytes_.insert(bytes_.end(), raw.begin(), raw.end()); }
  // A 32-bit length, then the bytes.
  void put_string(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    put_array(std::span<const char>(text.data(), text.size()));
  }
  [[nodiscard]] std::size_t size() const noexcept { return bytes_.size(); }
  [[nodiscard]] Bytes take() && { return std::move(bytes_); }
  [[nodiscard]] const Bytes& bytes() const noexcept { return bytes_; }

 private:
  Bytes bytes_;
};

// Reads what ByteWriter wrote. Every call throws Error{bad_input} naming `source` when the bytes run out.
class ByteReader {
 public:
  ByteReader(std::span<const std::byte> bytes, std::string source) : bytes_(bytes), source_(std::move(source)) {}

  template <typename T>
  requires std::is_arithmetic_v<T> T get() {
    T value;
    std::memcpy(&value, take(sizeof(T)).data(), sizeof(T));
    return value;
  }
  template <typename T>
  requires std::is_arithmetic_v<T> std::vector<T> get_array(std::uint64_t count) {
    if (count > remaining() / sizeof(T)) truncated(std::to_string(count) + " times " + std::to_string(sizeof(T)));
    std::vector<T> values(static_cast<std::size_t>(count));
    const auto raw = take(values.size() * sizeof(T));
    if (!raw.empty()) std::memcpy(values.data(), raw.data(), raw.size());
    return values;
  }
  std::string get_string() {
    const auto raw = take(get<std::uint32_t>());
    return {reinterpret_cast<const char*>(raw.data()), raw.size()};
  }
  std::span<const std::byte> take(std::size_t count) {
    if (count > remaining()) truncated(std::to_string(count));
    const auto out = bytes_.subspan(at_, count);
    at_ += count;
    return out;
  }
  [[nodiscard]] std::size_t remaining() const noexcept { return bytes_.size() - at_; }
  void expect_end() const {
    if (remaining() != 0) {
      throw Error(ErrorKind::bad_input,
                  {.file = source_, .found = std::to_string(remaining()) + " extra bytes", .expected = "the end"});
    }
  }
  // Throws Error{bad_input} with the source's name.
  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error(ErrorKind::bad_input, {.file = source_, .found = std::move(found), .expected = std::move(expected)});
  }

 private:
  [[noreturn]] void truncated(const std::string& wanted) const {
    fail(std::to_string(remaining()) + " bytes left", wanted + " more bytes (cut short or damaged)");
  }
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::string source_;
};

}  // namespace kinespace
