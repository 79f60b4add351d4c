// The extension module _kinespace: the exception, functional PCA, and the other parts.
#include <memory>
#include <optional>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "kinespace/base/error.h"
#include "kinespace/base/progress.h"
#include "kinespace/fpca/functional_pca.h"
#include "kinespace/version.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/documented.h"

namespace py = pybind11;

namespace kinespace::python {
namespace {

using Curves = py::array_t<double, py::array::c_style>;

// Lives as long as the process, as the interpreter's own exceptions do.
PyObject* error_type = nullptr;

const char* name_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::bad_input:
      return "bad_input";
    case ErrorKind::usage:
      return "usage";
    case ErrorKind::machine:
      break;
  }
  return "machine";
}

void raise(const Error& error) {
  const py::object raised = py::reinterpret_borrow<py::object>(error_type)(text(error.what()));
  const ErrorDetails& details = error.details();
  raised.attr("kind") = name_of(error.kind());
  raised.attr("file") = details.file.empty() ? py::object(py::none()) : py::object(text(details.file));
  raised.attr("line") = details.line == 0 ? py::object(py::none()) : py::object(py::int_(details.line));
  PyErr_SetObject(error_type, raised.ptr());
}

void bind_errors(py::module_& module) {
  error_type = PyErr_NewExceptionWithDoc("kinespace.Error", docstring("Error"), nullptr, nullptr);
  if (error_type == nullptr) throw py::error_already_set();
  module.add_object("Error", py::reinterpret_borrow<py::object>(error_type));
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      raise(error);
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
}

FpcaOptions options_of(std::optional<int> count, double share, std::optional<double> smoothing) {
  FpcaOptions out{.variance_share = share, .count = count};
  if (smoothing) {
    out.mean = MeanEstimate::smooth;
    out.smooth_covariance = true;
    out.estimate_noise = true;
    out.covariance_bandwidth = *smoothing;
    out.mean_bandwidth = *smoothing / 2;
  }
  return out;
}

// All arrays are views of the fit, which each keeps alive.
py::dict fit(const Curves& curves, std::optional<int> count, double share, std::optional<double> smoothing,
             double start, double end) {
  if (curves.ndim() != 2) throw py::value_error("curves: [curves, points]");
  const Eigen::Map<const CurveMatrix> samples(curves.data(), curves.shape(0), curves.shape(1));
  auto fitted = [&] {
    const py::gil_scoped_release released;
    return std::make_unique<FunctionalPca>(
        fit_functional_pca(samples, options_of(count, share, smoothing), {.start = start, .end = end}));
  }();
  const FunctionalPca& of = *fitted;
  const py::capsule owner = keep(std::move(fitted));
  const py::ssize_t functions = of.count();
  const py::ssize_t points = of.points();
  py::dict out;
  out["mean"] = view(of.observed_mean.data(), {points}, {}, owner);
  out["weights"] = view(of.weights.data(), {points}, {}, owner);
  out["eigenvalues"] = view(of.eigenvalues.data(), {functions}, {}, owner);
  out["shares"] = view(of.cumulative_shares.data(), {functions}, {}, owner);
  // Stored function by function: seen from here in C order.
  out["functions"] = view(of.observed_functions.data(), {functions, points}, {}, owner);
  out["projection"] = view(of.integration.data(), {functions, points}, {}, owner);
  out["noise_variance"] = of.noise_variance;
  return out;
}

}  // namespace

PYBIND11_MODULE(_kinespace, module) {
  module.doc() = "What kinespace is in C++; the package kinespace is what to import.";
  module.attr("__version__") = KINESPACE_VERSION;
  bind_errors(module);
  module.def("fit_functional_pca", &fit, py::arg("curves").noconvert(), py::kw_only(), py::arg("count"),
             py::arg("share"), py::arg("smoothing"), py::arg("start"), py::arg("end"));
  bind_clips(module);
  bind_library(module);
}

}  // namespace kinespace::python
