// NumPy arrays over memory of the library, and text as Python has it.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

namespace kinespace::python {

// Names come from files and need not be UTF-8: bytes that are not survive as surrogates, as in file names.
[[nodiscard]] inline pybind11::str text(const std::string& bytes) {
  PyObject* decoded = PyUnicode_DecodeUTF8(bytes.data(), static_cast<Py_ssize_t>(bytes.size()), "surrogateescape");
  if (decoded == nullptr) throw pybind11::error_already_set();
  return pybind11::reinterpret_steal<pybind11::str>(decoded);
}

[[nodiscard]] inline std::string bytes_of(const pybind11::str& text) {
  PyObject* encoded = PyUnicode_AsEncodedString(text.ptr(), "utf-8", "surrogateescape");
  if (encoded == nullptr) throw pybind11::error_already_set();
  return std::string(pybind11::reinterpret_steal<pybind11::bytes>(encoded));
}

[[nodiscard]] inline pybind11::list texts(const std::vector<std::string>& all) {
  pybind11::list out;
  for (const std::string& one : all) out.append(text(one));
  return out;
}

// What keeps memory alive that arrays look at.
template <typename Owner>
[[nodiscard]] pybind11::capsule keep(std::unique_ptr<Owner> owner) {
  pybind11::capsule capsule(owner.get(), [](void* kept) { delete static_cast<Owner*>(kept); });
  static_cast<void>(owner.release());
  return capsule;
}

using Extents = std::vector<pybind11::ssize_t>;

// An array over `data` [shape], with strides in bytes (none: C order), that keeps `owner` alive. No copy.
template <typename Number>
[[nodiscard]] pybind11::array_t<Number> view(const Number* data, Extents shape, Extents strides,
                                             const pybind11::object& owner) {
  return pybind11::array_t<Number>(std::move(shape), std::move(strides), data, owner);
}

template <typename Number>
[[nodiscard]] pybind11::array_t<Number> read_only_view(const Number* data, Extents shape, Extents strides,
                                                       const pybind11::object& owner) {
  auto out = view(data, std::move(shape), std::move(strides), owner);
  out.attr("setflags")(pybind11::arg("write") = false);
  return out;
}

}  // namespace kinespace::python
