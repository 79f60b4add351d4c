// The name that was probably meant, for messages about one that is not there.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace kinespace {

// How many characters must be added, taken away or changed to make one text the other (Levenshtein), by bytes and of
// the first 256 of each: names come from files and may be as long as those.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

// The nearest of the names; the first of equally near ones. nullopt when there are none.
[[nodiscard]] std::optional<std::string> nearest_name(std::string_view wanted, std::span<const std::string> names);

}  // namespace kinespace
