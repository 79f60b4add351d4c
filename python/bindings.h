// The parts of the extension module _kinespace. Each adds its functions and classes; what users see of them is the package
// python/kinespace, whose .pyi says their types.
#pragma once

#include <pybind11/pybind11.h>

namespace kinespace::python {

void bind_clips(pybind11::module_& module);    // clips, their files, streams
void bind_library(pybind11::module_& module);  // building libraries, looking into them

}  // namespace kinespace::python
