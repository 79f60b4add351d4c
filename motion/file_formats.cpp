#include "kinespace/motion/file_formats.h"

#include <algorithm>
#include <array>

#include "kinespace/motion/amc.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/gltf.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view export_remedy = "export it as .bvh or .glb";

// A reader of files that are one clip each.
template <Clip (*read)(const fs::path& path, const ClipReadOptions& options)>
std::vector<Clip> one_clip(const fs::path& path, const ClipReadOptions& options, ClipsWanted /*wanted*/) {
  std::vector<Clip> out;
  out.push_back(read(path, options));
  return out;
}

Clip amc_clip(const fs::path& path, const ClipReadOptions& options) {
  return read_amc(path, options.companion.value(), options);
}

constexpr std::array formats = {
    FileFormat{.ending = ".bvh", .kind = FileKind::bvh, .read = read_bvh, .list = bvh_clips, .write = write_bvh},
    FileFormat{
        .ending = ".amc", .kind = FileKind::amc, .read = one_clip<amc_clip>, .write = write_amc, .companion = ".asf"},
    FileFormat{.ending = ".asf",
               .kind = FileKind::asf,
               .instead = "the ending \".asf\"",
               .remedy = "name the .amc file; its .asf is found"},
    FileFormat{.ending = ".npy", .kind = FileKind::numpy, .holds_meshes = true, .companion = "triangles.npy"},
    FileFormat{.ending = ".obj", .kind = FileKind::obj, .holds_meshes = true},
    FileFormat{.ending = ".ply", .kind = FileKind::ply, .holds_meshes = true},
    FileFormat{.ending = ".glb",
               .kind = FileKind::glb,
               .read = read_gltf,
               .list = gltf_clips,
               .write = write_gltf,
               .holds_meshes = true},
    FileFormat{.ending = ".gltf",
               .kind = FileKind::json,
               .read = read_gltf,
               .list = gltf_clips,
               .write = write_gltf,
               .holds_meshes = true},
    FileFormat{.ending = ".svg", .kind = FileKind::svg},
    FileFormat{.ending = ".png", .kind = FileKind::png},
    FileFormat{.ending = ".ksm", .kind = FileKind::stream, .instead = "a stream", .remedy = "decode it first"},
    FileFormat{
        .ending = ".kspace", .kind = FileKind::database, .instead = "a library", .remedy = "export a clip of it"},
    FileFormat{.ending = ".fbx", .instead = "an FBX file", .remedy = export_remedy},
    FileFormat{.ending = ".c3d", .instead = "a C3D file", .remedy = export_remedy},
};

template <typename Wanted>
std::vector<std::string> endings_of(const Wanted& wanted) {
  std::vector<std::string> out;
  for (const FileFormat& format : formats) {
    if (wanted(format)) out.emplace_back(format.ending);
  }
  return out;
}

}  // namespace

std::span<const FileFormat> file_formats() {
  return formats;
}

const FileFormat* find_format(const fs::path& path) {
  const std::string ending = path.extension().string();
  const auto found = std::ranges::find_if(formats, [&](const FileFormat& f) { return same_word(ending, f.ending); });
  return found != formats.end() ? &*found : nullptr;
}

std::vector<std::string> clip_endings_read() {
  return endings_of([](const FileFormat& format) { return format.read != nullptr; });
}

std::vector<std::string> clip_endings_written() {
  return endings_of([](const FileFormat& format) { return format.write != nullptr; });
}

std::vector<std::string> mesh_endings() {
  return endings_of([](const FileFormat& format) { return format.holds_meshes; });
}

std::string listed(std::span<const std::string> endings) {
  std::string out;
  for (std::size_t i = 0; i < endings.size(); ++i) {
    if (i > 0) out += i + 1 < endings.size() ? ", " : " or ";
    out += endings[i];
  }
  return out;
}

}  // namespace kinespace
