#include "kinespace/motion/read.h"

#include <algorithm>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/motion/amc.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/gltf.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

bool has_ending(const std::filesystem::path& path, std::string_view ending) {
  return same_word(path.extension().string(), ending);
}

constexpr const char* writable_endings = ".bvh, .amc, .glb or .gltf";

bool can_write(const std::filesystem::path& path) {
  return is_motion_file(path) || has_ending(path, ".glb") || has_ending(path, ".gltf");
}

std::vector<std::filesystem::path> skeleton_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> out;
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator(folder, code)) {
    if (has_ending(entry.path(), ".asf")) out.push_back(entry.path());
  }
  return out;
}

std::filesystem::path skeleton_of(const std::filesystem::path& amc) {
  const auto candidates = skeleton_files(amc.has_parent_path() ? amc.parent_path() : ".");
  const std::string name = amc.stem().string();
  const std::filesystem::path* best = nullptr;
  for (const auto& candidate : candidates) {
    const std::string stem = candidate.stem().string();
    if (name.starts_with(stem) && (best == nullptr || stem.size() > best->stem().string().size())) best = &candidate;
  }
  if (best != nullptr) return *best;
  if (candidates.size() == 1) return candidates.front();
  throw Error(ErrorKind::bad_input, {.file = amc.string(),
                                     .found = candidates.empty() ? "no .asf file beside it"
                                                                 : std::to_string(candidates.size()) +
                                                                       " .asf files beside it, none of its name",
                                     .expected = "the skeleton of the motion",
                                     .remedy = "put the .asf file beside it or name it"});
}

// What is there in place of a motion file, and what to do about it.
std::pair<std::string, std::string> in_its_place(ErrorKind kind, const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return {"a folder", "name a file in it"};
  const bool input = kind == ErrorKind::bad_input;
  if (input && !std::filesystem::exists(path, ignored)) return {"no such file", "check the path"};
  if (has_ending(path, ".asf")) return {"the ending \".asf\"", "name the .amc file; its .asf is found"};
  if (input && (has_ending(path, ".glb") || has_ending(path, ".gltf"))) {
    return {"a glTF file, which is written only", "give the clip that it was made of"};
  }
  const std::string ending = path.extension().string();
  return {ending.empty() ? "no ending" : "the ending \"" + ending + "\"", ""};
}

[[noreturn]] void fail_ending(ErrorKind kind, const std::filesystem::path& path, const std::string& expected) {
  auto [found, remedy] = in_its_place(kind, path);
  throw Error(kind,
              {.file = path.string(), .found = std::move(found), .expected = expected, .remedy = std::move(remedy)});
}

}  // namespace

Clip read_clip(const std::filesystem::path& path, const std::optional<std::filesystem::path>& asf) {
  if (has_ending(path, ".bvh")) return read_bvh(path);
  if (has_ending(path, ".amc")) return read_amc(path, asf ? *asf : skeleton_of(path));
  fail_ending(ErrorKind::bad_input, path, "a motion file: .bvh or .amc");
}

void write_clip(const std::filesystem::path& path, const Clip& clip) {
  if (has_ending(path, ".bvh")) return write_bvh(path, clip);
  if (has_ending(path, ".amc")) return write_amc(path, clip);
  if (has_ending(path, ".glb") || has_ending(path, ".gltf")) return write_gltf(path, clip);
  fail_ending(ErrorKind::usage, path, writable_endings);
}

std::vector<std::filesystem::path> files_read(const std::filesystem::path& path,
                                              const std::optional<std::filesystem::path>& asf) {
  if (!has_ending(path, ".amc")) return {path};
  return {path, asf ? *asf : skeleton_of(path)};
}

std::vector<std::filesystem::path> files_written(const std::filesystem::path& path) {
  if (has_ending(path, ".amc")) return {path, std::filesystem::path(path).replace_extension(".asf")};
  if (!can_write(path)) fail_ending(ErrorKind::usage, path, writable_endings);
  return {path};
}

bool is_motion_file(const std::filesystem::path& path) {
  return has_ending(path, ".bvh") || has_ending(path, ".amc");
}

}  // namespace kinespace
