#include "python/documented.h"

#include <map>
#include <string>
#include <string_view>

namespace kinespace::python {

const char* docstring(const std::string& name) {
  static const std::map<std::string_view, const char*> all{
#include "docstrings.inc"
  };
  const auto found = all.find(name);
  return found == all.end() ? "" : found->second;
}

}  // namespace kinespace::python
