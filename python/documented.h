// Classes and functions whose docstrings are those of the stub, kinespace/_kinespace.pyi: one manual for help(), editors and
// readers.
#pragma once

#include <string>
#include <utility>

#include <pybind11/pybind11.h>

namespace kinespace::python {

// Of "Clip", "Clip.positions" or "read_clip"; empty where the stub has none.
[[nodiscard]] const char* docstring(const std::string& name);

template <typename T>
class DocumentedClass {
 public:
  DocumentedClass(pybind11::module_& module, const char* name) : name_(name), class_(module, name, docstring(name)) {}

  template <typename... Arguments>
  DocumentedClass& def(const char* name, Arguments&&... arguments) {
    class_.def(name, std::forward<Arguments>(arguments)..., doc(name));
    return *this;
  }
  template <typename Get>
  DocumentedClass& def_property_readonly(const char* name, const Get& get) {
    class_.def_property_readonly(name, get, doc(name));
    return *this;
  }
  template <typename Get, typename Set>
  DocumentedClass& def_property(const char* name, const Get& get, const Set& set) {
    class_.def_property(name, get, set, doc(name));
    return *this;
  }
  template <typename... Arguments>
  DocumentedClass& def_constructor(Arguments&&... arguments) {
    class_.def(std::forward<Arguments>(arguments)...);
    return *this;
  }

 private:
  [[nodiscard]] const char* doc(const char* member) const { return docstring(name_ + "." + member); }

  std::string name_;
  pybind11::class_<T> class_;
};

template <typename... Arguments>
void def_documented(pybind11::module_& module, const char* name, Arguments&&... arguments) {
  module.def(name, std::forward<Arguments>(arguments)..., docstring(name));
}

}  // namespace kinespace::python
