// Members of a JSON object by type, with messages that say where in the file they stand. For gltf/document.cpp only.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "kinespace/base/error.h"

namespace kinespace::gltf {

using Json = nlohmann::json;

class Fields {
 public:
  // `list[index]` is how messages call it; `list` must outlive this.
  Fields(const Json& value, const std::string& file, std::string_view list, std::size_t index = 0)
      : value_(value), file_(file), list_(list), index_(index) {
    if (!value.is_object()) fail("", std::string(value.type_name()), "an object");
  }

  [[noreturn]] void fail(std::string_view key, std::string found, std::string expected, std::string remedy = {}) const {
    throw Error(ErrorKind::bad_input,
                {.file = file_,
                 .found = fmt::format("{} at {}[{}]{}{}", found, list_, index_, key.empty() ? "" : ".", key),
                 .expected = std::move(expected),
                 .remedy = std::move(remedy)});
  }

  // Null where it is missing.
  [[nodiscard]] const Json* find(std::string_view key) const {
    const auto found = value_.find(key);
    return found == value_.end() ? nullptr : &*found;
  }
  [[nodiscard]] const Json& need(std::string_view key) const {
    const Json* const found = find(key);
    if (found == nullptr) fail(key, "nothing", "a value");
    return *found;
  }

  // -1 where it is missing.
  [[nodiscard]] int index(std::string_view key) const {
    const Json* const found = find(key);
    return found == nullptr ? -1 : index_of(*found, key);
  }
  [[nodiscard]] int need_index(std::string_view key) const { return index_of(need(key), key); }
  [[nodiscard]] std::uint64_t count(std::string_view key, std::uint64_t fallback) const {
    const Json* const found = find(key);
    return found == nullptr ? fallback : static_cast<std::uint64_t>(whole(*found, key, 9007199254740992.0));
  }
  [[nodiscard]] std::uint64_t need_count(std::string_view key) const {
    (void)need(key);
    return count(key, 0);
  }
  [[nodiscard]] bool flag(std::string_view key) const {
    const Json* const found = find(key);
    if (found != nullptr && !found->is_boolean()) fail(key, found->type_name(), "true or false");
    return found != nullptr && found->get<bool>();
  }
  [[nodiscard]] std::string_view text(std::string_view key) const {
    const Json* const found = find(key);
    if (found == nullptr) return {};
    if (!found->is_string()) fail(key, found->type_name(), "a string");
    return found->get_ref<const std::string&>();
  }

  // The elements of a list; none where it is missing.
  [[nodiscard]] const Json::array_t& list(std::string_view key) const {
    static const Json::array_t none;
    const Json* const found = find(key);
    if (found == nullptr) return none;
    if (!found->is_array()) fail(key, found->type_name(), "a list");
    return found->get_ref<const Json::array_t&>();
  }
  [[nodiscard]] std::vector<int> indices(std::string_view key) const {
    const Json::array_t& from = list(key);
    std::vector<int> out;
    out.reserve(from.size());
    for (const Json& value : from) out.push_back(index_of(value, key));
    return out;
  }
  [[nodiscard]] std::vector<double> numbers(std::string_view key) const {
    const Json::array_t& from = list(key);
    std::vector<double> out;
    out.reserve(from.size());
    for (const Json& value : from) {
      if (!value.is_number()) fail(key, value.type_name(), "a number");
      out.push_back(value.get<double>());
    }
    return out;
  }
  // Leaves `out` as it is where the member is missing.
  template <typename Array>
  bool fill(std::string_view key, Array& out) const {
    if (find(key) == nullptr) return false;
    const std::vector<double> from = numbers(key);
    if (from.size() != out.size()) fail(key, fmt::format("{} numbers", from.size()), fmt::format("{}", out.size()));
    std::copy(from.begin(), from.end(), out.begin());
    return true;
  }

  [[nodiscard]] int index_of(const Json& value, std::string_view key) const {
    if (value.is_number() && value.get<double>() == -1) return -1;  // as some write "none"
    return static_cast<int>(whole(value, key, std::numeric_limits<int>::max()));
  }

 private:
  double whole(const Json& value, std::string_view key, double most) const {
    if (!value.is_number()) fail(key, value.type_name(), "a whole number");
    const double number = value.get<double>();
    if (!(number >= 0 && number <= most) || number != std::floor(number)) {
      fail(key, fmt::format("{}", number), "a whole number, 0 or more");
    }
    return number;
  }

  const Json& value_;
  const std::string& file_;
  std::string_view list_;
  std::size_t index_;
};

}  // namespace kinespace::gltf
