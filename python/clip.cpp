// Clips, their files, and streams of them.
#include "kinespace/motion/clip.h"

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "kinespace/base/file.h"
#include "kinespace/codecs/pose_space/library_basis.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/documented.h"
#include "python/watch.h"

namespace py = pybind11;
namespace fs = std::filesystem;

namespace kinespace::python {
namespace {

constexpr py::ssize_t number = sizeof(double);

// The clip's own memory, [joint][frame][w x y z], seen as [frames, joints, 4].
py::array_t<double> rotations(const py::object& self) {
  const auto& clip = self.cast<const Clip&>();
  const py::ssize_t frames = clip.frames;
  return view(clip.rotations.data(), {frames, clip.skeleton.joint_count(), 4},
              {4 * number, frames * 4 * number, number}, self);
}

py::dict translations(const py::object& self) {
  static_assert(sizeof(Eigen::Vector3d) == 3 * number);
  const auto& clip = self.cast<const Clip&>();
  py::dict out;
  for (const Clip::TranslationTrack& track : clip.translations) {
    out[py::int_(track.joint)] = view(track.values.front().data(), {clip.frames, 3}, {}, self);
  }
  return out;
}

py::array_t<double> positions(const Clip& clip) {
  auto found = [&] {
    const py::gil_scoped_release released;
    return std::make_unique<JointPositions>(joint_positions(clip));
  }();
  const JointPositions& of = *found;
  return view(of.values.front().data(), {of.frames, of.joints, 3}, {}, keep(std::move(found)));
}

py::list joints(const Clip& clip) {
  py::list out;
  for (const Joint& joint : clip.skeleton.joints) out.append(text(joint.name));
  return out;
}

std::vector<int> parents(const Clip& clip) {
  std::vector<int> out;
  for (const Joint& joint : clip.skeleton.joints) out.push_back(joint.parent);
  return out;
}

py::array_t<double> offsets(const Clip& clip) {
  py::array_t<double> out(Extents{clip.skeleton.joint_count(), 3});
  auto to = out.mutable_unchecked<2>();
  for (py::ssize_t j = 0; j < to.shape(0); ++j) {
    for (int axis = 0; axis < 3; ++axis) to(j, axis) = clip.skeleton.joints[static_cast<std::size_t>(j)].offset[axis];
  }
  return out;
}

Clip part(const Clip& clip, int first, int count) {
  if (first < 0 || count < 1 || first > clip.frames - count) {
    throw py::value_error(
        fmt::format("frames {} to {} of a clip of {}", first, std::int64_t{first} + count - 1, clip.frames));
  }
  return slice(clip, first, count);
}

std::string description(const Clip& clip) {
  return fmt::format("<kinespace.Clip '{}': {} frames at {} Hz, {} joints>", clip.name, clip.frames, clip.rate_hz,
                     clip.skeleton.joint_count());
}

void bind_clip_class(py::module_& module) {
  DocumentedClass<Clip>(module, "Clip")
      .def_property(
          "name", [](const Clip& clip) { return text(clip.name); },
          [](Clip& clip, const py::str& name) { clip.name = bytes_of(name); })
      .def_property_readonly("frames", [](const Clip& clip) { return clip.frames; })
      .def_property_readonly("rate", [](const Clip& clip) { return clip.rate_hz; })
      .def_property_readonly("frame_time", [](const Clip& clip) { return 1 / clip.rate_hz; })
      .def_property_readonly("duration", &Clip::duration_s)
      .def_property_readonly("joints", &joints)
      .def_property_readonly("parents", &parents)
      .def_property_readonly("offsets", &offsets)
      .def_property_readonly("rotations", &rotations)
      .def_property_readonly("translations", &translations)
      .def_property_readonly("positions", &positions)
      .def("part", &part, py::arg("first"), py::arg("count"))
      .def("copy", [](const Clip& clip) { return Clip(clip); })
      .def("__copy__", [](const Clip& clip) { return Clip(clip); })
      .def(
          "__deepcopy__", [](const Clip& clip, const py::dict&) { return Clip(clip); }, py::arg("memo"))
      .def("__len__", [](const Clip& clip) { return clip.frames; })
      .def("__repr__", [](const Clip& clip) { return text(description(clip)); })
      .def(
          "write", [](const Clip& clip, const fs::path& path) { write_clip(path, clip); }, py::arg("path"),
          py::call_guard<py::gil_scoped_release>());
}

struct EncodeCall {
  std::string codec;
  CodecTarget target;
  std::map<std::string, std::string> settings;  // as on the command line
  std::optional<fs::path> basis;
};

CodecOptions options_of(const EncodeCall& call, const Progress& progress) {
  const Codec& codec = find_codec(call.codec);
  CodecOptions out{.target = call.target, .progress = progress};
  for (const auto& [name, value] : call.settings) out.settings[name] = find_setting(codec, name).parse(value);
  return out;
}

py::dict encode_clips(const std::vector<Clip>& clips, const fs::path& out, const std::string& codec,
                      std::optional<double> mean_error_cm, std::optional<double> max_error_cm,
                      std::optional<std::int64_t> bytes, const std::map<std::string, std::string>& settings,
                      const std::optional<fs::path>& basis, const py::object& progress) {
  const EncodeCall call{codec, {mean_error_cm, max_error_cm, bytes}, settings, basis};
  struct Written {
    std::size_t bytes = 0;
    MeasuredError error;
  };
  const Written written = watched(progress, [&](const Progress& watch) {
    CodecOptions options = options_of(call, watch);
    std::optional<PoseSpaceBasis> tables;
    if (basis && !clips.empty()) tables = library_basis(*basis, clips.front().skeleton.tree_hash(), watch);
    if (tables) options.basis = &*tables;
    const Bytes stream = encode(call.codec, clips, options);
    watch.check_stop();
    write_file_atomically(out, stream);
    return Written{stream.size(), Bitstream::parse(stream, out.string()).error()};
  });
  py::dict report;
  report["bytes"] = written.bytes;
  report["mean_joint_error_cm"] = written.error.mean_joint_error_cm;
  report["max_joint_error_cm"] = written.error.max_joint_error_cm;
  return report;
}

std::vector<Clip> decode_clips(const fs::path& path, int level, const std::optional<fs::path>& basis) {
  const FileContent file(path);
  const std::string id = basis_of(file.bytes(), path.string());
  std::optional<PoseSpaceBasis> tables;
  if (basis && !id.empty()) tables = library_basis_by_id(*basis, id);
  return open_stream(file.bytes(), path.string(), tables ? &*tables : nullptr)->decode_all(level);
}

std::vector<std::string> codec_names() {
  std::vector<std::string> out;
  for (const Codec* codec : all_codecs()) out.emplace_back(codec->name());
  return out;
}

}  // namespace

void bind_clips(py::module_& module) {
  bind_clip_class(module);
  def_documented(
      module, "read_clip",
      [](const fs::path& path, const std::optional<fs::path>& asf, const std::string& animation) {
        return read_clip(path, {.companion = asf, .animation = animation});
      },
      py::arg("path"), py::arg("asf") = py::none(), py::arg("animation") = "",
      py::call_guard<py::gil_scoped_release>());
  module.def("find_motion_files", &find_motion_files, py::arg("paths"), py::call_guard<py::gil_scoped_release>());
  module.def(
      "clip_names", [](const std::vector<fs::path>& files) { return texts(clip_names(files)); }, py::arg("files"));
  module.def("codec_names", &codec_names);
  def_documented(module, "encode_clips", &encode_clips, py::arg("clips"), py::arg("out"), py::kw_only(),
                 py::arg("codec"), py::arg("mean_error_cm"), py::arg("max_error_cm"), py::arg("bytes"),
                 py::arg("settings"), py::arg("basis"), py::arg("progress"));
  def_documented(module, "decode_clips", &decode_clips, py::arg("path"), py::kw_only(), py::arg("level"),
                 py::arg("basis"), py::call_guard<py::gil_scoped_release>());
}

}  // namespace kinespace::python
