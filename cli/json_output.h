// JSON as the command prints it: one object on standard output, keys in the order they were added.
//
// The keys are a contract with other programs: keys may be added, none is ever renamed. Numbers that are not finite
// become null, and bytes of a file name that are not UTF-8 become U+FFFD, so that the output is always valid JSON.
// Names are the true ones; what a terminal would obey in them stands as an escape.
#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

namespace kinespace::cli {

using Json = nlohmann::ordered_json;

// null where there is none.
template <class Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json();
}

// Prints the object and a newline on standard output.
void print_json(const Json& object);

// Prints one line a key, "name  value", for people: underscores become spaces, values are aligned, numbers have six
// significant digits, lists are counted.
void print_fields(const Json& object);

}  // namespace kinespace::cli
