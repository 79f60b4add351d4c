// Long calls: the GIL is let go, Ctrl-C stops them, and a callback hears how far they are.
//
// Python runs the handlers of signals on the main thread only, and only when it is asked to: the thread that made the call
// asks between units of work. What a handler or the callback raises stops the work, and is raised by the call.
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <thread>

#include <pybind11/pybind11.h>

#include "kinespace/base/progress.h"
#include "python/arrays.h"

namespace kinespace::python {

class Watch {
 public:
  // `report`: None, or called with the stage (str) and its share done (float, 0 to 1). The GIL is held.
  explicit Watch(pybind11::object report) : report_(std::move(report)), caller_(std::this_thread::get_id()) {}

  // Refers to the watch. To be used without the GIL.
  [[nodiscard]] Progress progress() {
    Progress out;
    out.stop_requested = [this] { return stop_requested(); };
    if (!report_.is_none()) {
      out.report = [this](std::string_view stage, double done) { report(std::string(stage), done); };
    }
    return out;
  }

  // Raises what stopped the work. The GIL is held.
  void raise_what_was_raised() {
    if (raised_) throw pybind11::error_already_set(*raised_);
  }

 private:
  bool stop_requested() {
    if (!stopped_ && std::this_thread::get_id() == caller_) {
      const pybind11::gil_scoped_acquire held;
      if (PyErr_CheckSignals() != 0) stop_by(pybind11::error_already_set());
    }
    return stopped_;
  }

  void report(const std::string& stage, double done) {
    if (stopped_) return;
    const pybind11::gil_scoped_acquire held;
    try {
      report_(text(stage), done);
    } catch (const pybind11::error_already_set& raised) {
      stop_by(raised);
    }
  }

  void stop_by(const pybind11::error_already_set& raised) {
    if (!raised_) raised_.emplace(raised);
    stopped_ = true;
  }

  pybind11::object report_;
  std::thread::id caller_;
  std::optional<pybind11::error_already_set> raised_;  // only touched with the GIL
  std::atomic<bool> stopped_ = false;
};

// work(progress) without the GIL. Raises what a signal's handler or the callback raised, in its stead.
template <typename Work>
auto watched(const pybind11::object& report, const Work& work) {
  Watch watch(report);
  try {
    auto result = [&] {
      const pybind11::gil_scoped_release released;
      return work(watch.progress());
    }();
    watch.raise_what_was_raised();
    return result;
  } catch (const Interrupted&) {
    watch.raise_what_was_raised();
    throw;
  }
}

}  // namespace kinespace::python
