// Building libraries, looking into them, asking them.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/fpca/clip_space.h"
#include "kinespace/kernels/device.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/library/library_view.h"
#include "kinespace/synthesis/retrieval.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/documented.h"
#include "python/watch.h"

namespace py = pybind11;
namespace fs = std::filesystem;

namespace kinespace::python {
namespace {

// A LibraryView, for one thread at a time. The GIL is let go before a turn is waited for, so that neither waits for the
// other.
class OpenLibrary {
 public:
  explicit OpenLibrary(const fs::path& path) : view_(path), rows_(view_.library().clips()) {}

  // work(view). To be called without the GIL.
  template <typename Work>
  auto take_turn(const Work& work) {
    if (in_turn_ == std::this_thread::get_id()) {
      throw Error(ErrorKind::usage, {.file = path().string(),
                                     .found = "a call of a Library inside of its own progress callback",
                                     .expected = "another Library of the same file there"});
    }
    const std::scoped_lock lock(mutex_);
    const Turn turn(in_turn_);
    return work(view_);
  }
  // The same, of a caller that holds the GIL.
  template <typename Work>
  auto quietly(const Work& work) {
    const py::gil_scoped_release released;
    return take_turn(work);
  }

  [[nodiscard]] const fs::path& path() const { return view_.library().path(); }
  // By id, as they were when the library was opened.
  [[nodiscard]] const std::vector<ClipRow>& rows() const { return rows_; }
  // That all clips are in. Throws Error{usage} where they are in several.
  [[nodiscard]] std::int64_t only_space() const;

  // Read once and kept.
  [[nodiscard]] py::array_t<float> vectors();

 private:
  class Turn {
   public:
    explicit Turn(std::atomic<std::thread::id>& whose) : whose_(whose) { whose_.store(std::this_thread::get_id()); }
    ~Turn() { whose_.store({}); }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    std::atomic<std::thread::id>& whose_;
  };

  LibraryView view_;
  std::vector<ClipRow> rows_;
  std::mutex mutex_;
  std::atomic<std::thread::id> in_turn_;
  std::optional<py::array_t<float>> vectors_;
};

std::int64_t OpenLibrary::only_space() const {
  if (rows_.empty()) throw Error(ErrorKind::usage, {.file = path().string(), .found = "no clips"});
  const std::int64_t first = rows_.front().space_id;
  if (!std::ranges::all_of(rows_, [&](const ClipRow& row) { return row.space_id == first; })) {
    throw Error(ErrorKind::usage, {.file = path().string(),
                                   .found = "clips of several joint trees, whose vectors cannot be compared",
                                   .expected = "a library of one",
                                   .remedy = "build one of each"});
  }
  return first;
}

py::array_t<float> OpenLibrary::vectors() {
  if (!vectors_) {
    const std::int64_t space = only_space();
    auto read = quietly([&](const LibraryView& view) {
      return std::make_unique<RetrievalMatrix>(view.library().retrieval_matrix(space));
    });
    const RetrievalMatrix& of = *read;
    const Extents shape{static_cast<py::ssize_t>(of.clip_ids.size()), static_cast<py::ssize_t>(of.dimensions)};
    vectors_ = read_only_view(of.values.data(), shape, {}, keep(std::move(read)));
  }
  return *vectors_;
}

// Numbers of the rows of the library, one a clip.
template <typename Number, typename Of>
py::array_t<Number> numbers(const OpenLibrary& library, const Of& of) {
  py::array_t<Number> out(static_cast<py::ssize_t>(library.rows().size()));
  std::ranges::transform(library.rows(), out.mutable_data(), of);
  return out;
}

py::list names(const OpenLibrary& library) {
  py::list out;
  for (const ClipRow& row : library.rows()) out.append(text(row.name));
  return out;
}

py::list labels(const OpenLibrary& library) {
  py::list out;
  for (const ClipRow& row : library.rows()) out.append(texts(row.labels));
  return out;
}

std::vector<float> weights_of(LibraryView& view, const ClipRow& row, bool weighted) {
  return weighted ? distance_weights(view.skeleton(row.skeleton_id)) : std::vector<float>();
}

py::array_t<double> distance_matrix(OpenLibrary& library, bool weighted, const py::object& progress) {
  constexpr py::ssize_t rows_at_once = 64;  // between two looks at Ctrl-C
  const py::array_t<float> vectors = library.vectors();
  const py::ssize_t clips = vectors.shape(0);
  const auto dimensions = static_cast<std::size_t>(vectors.shape(1));
  const float* data = vectors.data();
  const auto vector = [&](py::ssize_t i) {
    return std::span(data + static_cast<std::size_t>(i) * dimensions, dimensions);
  };
  py::array_t<double> out(Extents{clips, clips});
  double* to = out.mutable_data();
  watched(progress, [&](const Progress& watch) {
    const std::vector<float> weights =
        library.take_turn([&](LibraryView& view) { return weights_of(view, library.rows().front(), weighted); });
    for (py::ssize_t first = 0; first < clips; first += rows_at_once) {
      watch.check_stop();
      watch.at("distances", static_cast<double>(first) / static_cast<double>(clips));
      parallel_for(first, std::min(clips, first + rows_at_once), [&](py::ssize_t i) {
        for (py::ssize_t j = 0; j < clips; ++j) {
          // In one order, so that the matrix is symmetric to the last bit.
          to[i * clips + j] = std::sqrt(squared_distance(vector(std::min(i, j)), vector(std::max(i, j)), weights));
        }
      });
    }
    return true;
  });
  return out;
}

// By the cycles that a sequence holds: the functions of each group of curves, [functions, points].
py::dict functions(const py::object& self) {
  auto& library = self.cast<OpenLibrary&>();
  const std::int64_t id = library.only_space();
  const RegisteredSpace* space =
      library.quietly([&](LibraryView& view) { return &view.space(id); });  // stays where it is
  py::dict out;
  for (int cycles = 0; cycles < static_cast<int>(space->sets().size()); ++cycles) {
    if (!space->has(cycles)) continue;
    py::list groups;
    for (const FunctionGroup& group : space->of(cycles).groups()) {
      groups.append(read_only_view(group.functions.data(), {group.functions.cols(), group.functions.rows()}, {}, self));
    }
    out[py::int_(cycles)] = groups;
  }
  return out;
}

Clip clip(OpenLibrary& library, const py::str& name, std::optional<int> count) {
  if (count && *count < 1) throw py::value_error(fmt::format("functions: {}, expected 1 or more", *count));
  const std::string wanted = bytes_of(name);
  return library.quietly([&](LibraryView& view) { return view.clip(view.require_clip(wanted), count.value_or(-1)); });
}

py::dict level_errors(OpenLibrary& library, const py::str& name) {
  const std::string wanted = bytes_of(name);
  const std::vector<LevelError> levels =
      library.quietly([&](LibraryView& view) { return view.level_errors(view.require_clip(wanted)); });
  const auto count = static_cast<py::ssize_t>(levels.size());
  py::array_t<std::int64_t> level(count);
  py::array_t<double> mean(count);
  py::array_t<double> largest(count);
  std::ranges::transform(levels, level.mutable_data(), [](const LevelError& of) { return of.level; });
  std::ranges::transform(levels, mean.mutable_data(),
                         [](const LevelError& of) { return of.error.mean_joint_error_cm; });
  std::ranges::transform(levels, largest.mutable_data(),
                         [](const LevelError& of) { return of.error.max_joint_error_cm; });
  py::dict out;
  out["functions"] = level;
  out["mean_joint_error_cm"] = mean;
  out["max_joint_error_cm"] = largest;
  return out;
}

QueryOptions query_options(int k, bool rerank, bool weighted, const std::vector<py::str>& wanted) {
  QueryOptions out{.k = k, .rerank = rerank, .weighted = weighted};
  for (const py::str& label : wanted) out.labels.push_back(bytes_of(label));
  out.validate();
  return out;
}

std::vector<Match> query_by_name(OpenLibrary& library, const py::str& name, int k, bool rerank, bool weighted,
                                 const std::vector<py::str>& wanted, const std::string& device,
                                 const py::object& progress) {
  const QueryOptions options = query_options(k, rerank, weighted, wanted);
  const std::string clip_name = bytes_of(name);
  return watched(progress, [&](const Progress& watch) {
    return library.take_turn([&](LibraryView& view) {
      const ClipRow row = view.require_clip(clip_name);
      return nearest_motions(view, view.curves(row), view.skeleton(row.skeleton_id), options, row.name,
                             Compute::open(device), watch);
    });
  });
}

std::vector<Match> query_by_clip(OpenLibrary& library, const Clip& clip, int k, bool rerank, bool weighted,
                                 const std::vector<py::str>& wanted, const std::string& device,
                                 const py::object& progress) {
  const QueryOptions options = query_options(k, rerank, weighted, wanted);
  return watched(progress, [&](const Progress& watch) {
    return library.take_turn([&](LibraryView& view) {
      static_cast<void>(view.require_space_for(clip, clip.name));
      return nearest_motions(view, clip, options, {}, Compute::open(device), watch);
    });
  });
}

std::string description(const OpenLibrary& library) {
  return fmt::format("<kinespace.Library '{}': {} clips>", library.path().string(), library.rows().size());
}

template <auto query>
void bind_query(DocumentedClass<OpenLibrary>& library) {
  library.def("query", query, py::arg("clip"), py::arg("k") = 10, py::kw_only(), py::arg("rerank") = true,
              py::arg("weighted") = false, py::arg("labels") = std::vector<py::str>(), py::arg("device") = "auto",
              py::arg("progress") = py::none());
}

void bind_library_class(py::module_& module) {
  DocumentedClass<Match>(module, "Match")
      .def_property_readonly("clip", [](const Match& match) { return text(match.clip); })
      .def_property_readonly("labels", [](const Match& match) { return texts(match.labels); })
      .def_property_readonly("distance", [](const Match& match) { return match.distance; })
      .def_property_readonly("vector_distance", [](const Match& match) { return match.vector_distance; })
      .def_property_readonly("start", [](const Match& match) { return match.start_s; })
      .def_property_readonly("end", [](const Match& match) { return match.end_s; })
      .def("__repr__", [](const Match& match) {
        return text(fmt::format("<kinespace.Match '{}' at {:.5g}>", match.clip, match.distance));
      });

  DocumentedClass<OpenLibrary> library(module, "Library");
  library.def_constructor(py::init([](const fs::path& path) {
                            const py::gil_scoped_release released;
                            return std::make_unique<OpenLibrary>(path);
                          }),
                          py::arg("path"));
  library.def_property_readonly("path", &OpenLibrary::path);
  library.def_property_readonly("clips", &names);
  library.def_property_readonly("labels", &labels);
  library.def_property_readonly("frames", [](const OpenLibrary& of) {
    return numbers<std::int64_t>(of, [](const ClipRow& row) { return row.frames; });
  });
  library.def_property_readonly("rates", [](const OpenLibrary& of) {
    return numbers<double>(of, [](const ClipRow& row) { return row.rate_hz; });
  });
  library.def_property_readonly("vectors", &OpenLibrary::vectors);
  library.def_property_readonly("functions", &functions);
  library.def("distance_matrix", &distance_matrix, py::kw_only(), py::arg("weighted") = false,
              py::arg("progress") = py::none());
  library.def("clip", &clip, py::arg("name"), py::arg("functions") = py::none());
  library.def("level_errors", &level_errors, py::arg("name"));
  bind_query<&query_by_name>(library);
  bind_query<&query_by_clip>(library);
  library.def("__len__", [](const OpenLibrary& of) { return of.rows().size(); });
  library.def("__contains__", [](const OpenLibrary& of, const py::str& name) {
    const std::string wanted = bytes_of(name);
    return std::ranges::any_of(of.rows(), [&](const ClipRow& row) { return row.name == wanted; });
  });
  library.def("__repr__", [](const OpenLibrary& of) { return text(description(of)); });
}

Grouping grouping_of(const std::string& name) {
  if (name == "all") return Grouping::all_together;
  if (name == "component") return Grouping::per_component;
  if (name == "joint") return Grouping::per_joint_component;
  throw py::value_error(fmt::format("grouping: \"{}\", expected \"all\", \"component\" or \"joint\"", name));
}

py::dict to_python(const LibraryReport& report) {
  py::dict out;
  out["clips"] = report.clips;
  out["added"] = report.added;
  out["unchanged"] = report.unchanged;
  out["sequences"] = report.sequences;
  out["spaces"] = report.spaces;
  out["functions"] = report.functions;
  out["variance"] = report.variance;
  out["movement"] = report.movement;
  out["mean_joint_error_cm"] = report.mean_joint_error_cm;
  out["max_joint_error_cm"] = report.max_joint_error_cm;
  out["frames"] = report.frames;
  out["bytes"] = report.bytes;
  out["doubts"] = texts(report.doubts);
  return out;
}

py::dict build(const std::vector<fs::path>& paths, const fs::path& out, bool add, bool by_skeleton,
               const std::optional<fs::path>& asf, double variance, std::optional<int> count, int points,
               const std::string& grouping, bool smooth, int cycles, bool align, const std::string& device,
               const py::object& progress) {
  LibraryBuilderOptions options{.by_skeleton = by_skeleton, .add = add, .asf = asf};
  options.space.align = align;
  options.space.sequences.equal_windows = !align;
  options.space.sequences.most_cycles = cycles;
  options.space.space.grouping = grouping_of(grouping);
  options.space.space.variance_share = variance;
  options.space.space.functions = count;
  options.space.space.points = points;
  options.space.space.smooth = smooth;
  return to_python(watched(progress, [&](const Progress& watch) {
    return build_library(find_motion_files(paths), out, options, Compute::open(device), watch);
  }));
}

}  // namespace

void bind_library(py::module_& module) {
  bind_library_class(module);
  const MotionSpaceOptions space;
  const SequenceOptions sequences;
  def_documented(module, "build_library", &build, py::arg("paths"), py::arg("out"), py::kw_only(),
                 py::arg("add") = false, py::arg("by_skeleton") = false, py::arg("asf") = py::none(),
                 py::arg("variance") = space.variance_share, py::arg("functions") = py::none(),
                 py::arg("points") = space.points, py::arg("grouping") = "all", py::arg("smooth") = false,
                 py::arg("cycles") = sequences.most_cycles, py::arg("align") = true, py::arg("device") = "auto",
                 py::arg("progress") = py::none());
}

}  // namespace kinespace::python
