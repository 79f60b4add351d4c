#include "kinespace/mesh/mesh_files.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/mesh/detail/mesh_formats.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

namespace fs = std::filesystem;

constexpr const char* positions_name = "positions.npy";
constexpr const char* triangles_name = "triangles.npy";

[[noreturn]] void fail(ErrorKind kind, const fs::path& path, std::string found, std::string expected,
                       std::string remedy = {}) {
  throw Error(
      kind,
      {.file = path.string(), .found = std::move(found), .expected = std::move(expected), .remedy = std::move(remedy)});
}

bool has_ending(const fs::path& path, const char* ending) {
  return same_word(path.extension().string(), ending);
}

// Numbers in names count as numbers: f2 before f10.
bool naturally_before(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const auto number = [](const std::string& s, std::size_t& at) {
      while (at < s.size() && s[at] == '0') ++at;
      const std::size_t first = at;
      while (at < s.size() && is_digit(s[at])) ++at;
      return std::string_view(s).substr(first, at - first);
    };
    const std::string_view x = number(a, i), y = number(b, j);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  if (i < a.size() || j < b.size()) return j < b.size();
  return a < b;  // 01 and 1
}

std::vector<fs::path> files_in(const fs::path& folder, const char* ending) {
  std::vector<fs::path> out;
  std::error_code code;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    if (has_ending(it->path(), ending)) out.push_back(it->path());
  }
  if (code) fail(ErrorKind::bad_input, folder, "cannot be read: " + code.message(), "a folder");
  std::sort(out.begin(), out.end(), [](const fs::path& a, const fs::path& b) {
    return naturally_before(a.filename().string(), b.filename().string());
  });
  return out;
}

using ParseFrame = MeshFrame (*)(std::string_view, const std::string&, const Progress&);

void require_same(const MeshSequence& mesh, const MeshFrame& frame, const fs::path& file, std::size_t number) {
  const auto refuse = [&](const std::string& what, std::size_t found, std::size_t expected) {
    fail(ErrorKind::bad_input, file, fmt::format("{} {} in frame {}", found, what, number),
         fmt::format("{} as in frame 0", expected), "every frame must have the vertices and triangles of the first");
  };
  if (frame.positions.size() != mesh.frame_size()) {
    refuse("vertices", frame.positions.size() / 3, static_cast<std::size_t>(mesh.vertices));
  }
  if (frame.triangles.size() != mesh.triangles.size()) {
    refuse("triangles", frame.triangles.size(), mesh.triangles.size());
  }
  const auto differs = std::mismatch(frame.triangles.begin(), frame.triangles.end(), mesh.triangles.begin());
  if (differs.first == frame.triangles.end()) return;
  const Triangle &found = *differs.first, &expected = *differs.second;
  fail(ErrorKind::bad_input, file,
       fmt::format("triangle {} of frame {} is ({}, {}, {})", differs.first - frame.triangles.begin(), number, found[0],
                   found[1], found[2]),
       fmt::format("({}, {}, {}) as in frame 0", expected[0], expected[1], expected[2]),
       "every frame must have the triangles of the first, in the same order");
}

MeshSequence read_frames(const std::vector<fs::path>& files, ParseFrame parse, const Progress& progress) {
  MeshSequence out;
  std::uintmax_t bytes = 0;
  std::error_code ignored;
  for (const fs::path& file : files) bytes += fs::file_size(file, ignored);
  for (std::size_t f = 0; f < files.size(); ++f) {
    progress.check_stop();
    progress.at("reading", static_cast<double>(f) / static_cast<double>(files.size()));
    const FileContent content(files[f]);
    MeshFrame frame = parse(content.text(), files[f].string(), progress);
    if (f == 0) {
      out.vertices = static_cast<int>(frame.positions.size() / 3);
      out.triangles = std::move(frame.triangles);
      // Only as much as the files can hold: a vertex takes at least 8 bytes of text.
      const std::size_t wanted = out.frame_size() * files.size();
      if (wanted / 3 <= bytes / 8) out.positions.reserve(wanted);
    } else {
      require_same(out, frame, files[f], f);
    }
    out.positions.insert(out.positions.end(), frame.positions.begin(), frame.positions.end());
  }
  out.frames = static_cast<int>(files.size());
  return out;
}

MeshSequence read_folder(const fs::path& path, const Progress& progress) {
  if (fs::exists(path / positions_name)) return read_numpy_mesh(path / positions_name, path / triangles_name);
  const std::vector<fs::path> obj = files_in(path, ".obj"), ply = files_in(path, ".ply");
  if (obj.empty() && ply.empty()) {
    fail(ErrorKind::bad_input, path, "a folder without meshes",
         "positions.npy and triangles.npy, or .obj or .ply files");
  }
  if (!obj.empty() && !ply.empty()) {
    fail(ErrorKind::bad_input, path, "a folder with .obj and .ply files", "one kind", "put them into two folders");
  }
  return obj.empty() ? read_frames(ply, parse_ply, progress) : read_frames(obj, parse_obj, progress);
}

MeshSequence read_any(const fs::path& path, const MeshReadOptions& options) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return read_folder(path, options.progress);
  if (has_ending(path, ".npy")) return read_numpy_mesh(path, path.parent_path() / triangles_name);
  if (has_ending(path, ".obj")) return read_frames({path}, parse_obj, options.progress);
  if (has_ending(path, ".ply")) return read_frames({path}, parse_ply, options.progress);
  if (has_ending(path, ".gltf") || has_ending(path, ".glb")) {
    const FileContent file(path);
    return parse_gltf_mesh(file.text(), path, options);
  }
  if (!fs::exists(path, ignored)) fail(ErrorKind::bad_input, path, "no such file or folder", "a mesh sequence");
  fail(ErrorKind::bad_input, path, "another kind of file", "a folder, " + listed(mesh_endings()));
}

// A folder under another name, removed unless it became the one that was wanted.
class FolderInTheMaking {
 public:
  explicit FolderInTheMaking(const fs::path& target) : target_(fs::absolute(target).lexically_normal()) {
    if (target_.filename().empty()) target_ = target_.parent_path();  // a slash at the end
    static std::atomic<unsigned> count{0};
    made_ = target_.parent_path() / fmt::format(".kinespace-{}-{}.part", ::getpid(), count++);
    std::error_code code;
    fs::create_directory(made_, code);
    if (code) fail(ErrorKind::machine, target, "cannot make a folder beside it: " + code.message(), "a writable place");
  }
  ~FolderInTheMaking() {
    std::error_code ignored;
    if (!done_) fs::remove_all(made_, ignored);
  }
  FolderInTheMaking(const FolderInTheMaking&) = delete;
  FolderInTheMaking& operator=(const FolderInTheMaking&) = delete;

  [[nodiscard]] const fs::path& path() const { return made_; }
  void finish() {
    std::error_code code;
    fs::rename(made_, target_, code);
    if (code) fail(ErrorKind::machine, target_, "cannot be put in place: " + code.message(), "a writable place");
    done_ = true;
  }

 private:
  fs::path target_, made_;
  bool done_ = false;
};

void fill_folder(const fs::path& folder, const MeshSequence& mesh, MeshFormat format, const Progress& progress) {
  if (format == MeshFormat::numpy) {
    const std::string triangles = format_numpy_triangles(mesh.triangles), positions = format_numpy_positions(mesh);
    const std::array files = {FileToWrite{folder / triangles_name, triangles},
                              FileToWrite{folder / positions_name, positions}};
    write_files_atomically(files);
    return;
  }
  const bool obj = format == MeshFormat::obj;
  for (int f = 0; f < mesh.frames; ++f) {
    progress.check_stop();
    write_file_atomically(folder / fmt::format("frame_{:05}.{}", f + 1, obj ? "obj" : "ply"),
                          obj ? format_obj(mesh.frame(f), mesh.triangles) : format_ply(mesh.frame(f), mesh.triangles));
  }
}

// True for a folder with nothing in it but the two NumPy files, which may be replaced one by one.
bool holds_only_numpy(const fs::path& folder) {
  bool some = false;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    if (name != positions_name && name != triangles_name) return false;
    some = true;
  }
  return some;
}

}  // namespace

MeshSequence read_numpy_mesh(const fs::path& positions, const fs::path& triangles, std::optional<double> rate_hz) {
  const FileContent numbers(positions), indices(triangles);
  MeshSequence out = parse_numpy(numbers.text(), positions.string(), indices.text(), triangles.string());
  out.name = positions.parent_path().filename().string();
  if (rate_hz) out.rate_hz = *rate_hz;
  require_valid(out, positions.string());
  return out;
}

void MeshReadOptions::validate() const {
  if (rate_hz && !(*rate_hz > 0 && *rate_hz <= 1e6)) {
    fail(ErrorKind::usage, {}, fmt::format("a rate of {} frames a second", *rate_hz), "above 0 and at most 1e6");
  }
  if (most_bytes && *most_bytes == 0) fail(ErrorKind::usage, {}, "a memory limit of 0", "more than 0");
}

MeshSequence read_mesh_sequence(const fs::path& path, const MeshReadOptions& options) {
  options.validate();
  MeshSequence out = read_any(path, options);
  const bool tells_rate = has_ending(path, ".gltf") || has_ending(path, ".glb");
  if (options.rate_hz && !tells_rate) out.rate_hz = *options.rate_hz;
  fs::path named = path.filename().empty() ? path.parent_path() : path;
  out.name = named.stem().string();
  require_valid(out, path.string());
  return out;
}

void write_mesh_sequence(const fs::path& path, const MeshSequence& mesh, MeshFormat format, const Progress& progress) {
  require_valid(mesh, mesh.name);
  if (format == MeshFormat::gltf) {
    write_file_atomically(path, format_gltf_mesh(mesh, has_ending(path, ".glb")));
    return;
  }
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_directory(path, ignored)) {
    fail(ErrorKind::usage, path, "a file", "the name of a folder");
  }
  if (fs::is_directory(path, ignored) && !fs::is_empty(path, ignored)) {
    if (format != MeshFormat::numpy || !holds_only_numpy(path)) {
      fail(ErrorKind::usage, path, "a folder that is not empty", "a new or an empty folder",
           "give another output name");
    }
    fill_folder(path, mesh, format, progress);
    return;
  }
  FolderInTheMaking folder(path);
  fill_folder(folder.path(), mesh, format, progress);
  folder.finish();
}

bool may_be_mesh_sequence(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return true;
  const FileFormat* format = find_format(path);
  return format != nullptr && format->holds_meshes;
}

}  // namespace kinespace
