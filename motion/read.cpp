#include "kinespace/motion/read.h"

#include <algorithm>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder, std::string_view ending) {
  std::vector<std::filesystem::path> out;
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator(folder, code)) {
    if (same_word(entry.path().extension().string(), ending)) out.push_back(entry.path());
  }
  return out;
}

// The file that goes with a clip: of those with the ending beside it the one whose name starts the clip's, else the only one.
std::filesystem::path companion_of(const std::filesystem::path& clip, std::string_view ending) {
  const auto candidates = files_of(clip.has_parent_path() ? clip.parent_path() : ".", ending);
  const std::string name = clip.stem().string();
  const std::filesystem::path* best = nullptr;
  for (const auto& candidate : candidates) {
    const std::string stem = candidate.stem().string();
    if (name.starts_with(stem) && (best == nullptr || stem.size() > best->stem().string().size())) best = &candidate;
  }
  if (best != nullptr) return *best;
  if (candidates.size() == 1) return candidates.front();
  throw Error(
      ErrorKind::bad_input,
      {.file = clip.string(),
       .found = candidates.empty() ? fmt::format("no {} file beside it", ending)
                                   : fmt::format("{} {} files beside it, none of its name", candidates.size(), ending),
       .expected = "the skeleton of the motion",
       .remedy = fmt::format("put the {} file beside it or name it", ending)});
}

// What is there in place of a motion file, and what to do about it.
std::pair<std::string, std::string> in_its_place(ErrorKind kind, const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return {"a folder", "name a file in it"};
  const bool input = kind == ErrorKind::bad_input;
  if (input && !std::filesystem::exists(path, ignored)) return {"no such file", "check the path"};
  const FileFormat* format = find_format(path);
  const bool of_other_use = format != nullptr && !format->instead.empty() && (input || format->kind == FileKind::asf);
  if (of_other_use) return {std::string(format->instead), std::string(format->remedy)};
  const std::string ending = path.extension().string();
  return {ending.empty() ? "no ending" : "the ending \"" + ending + "\"", ""};
}

[[noreturn]] void fail_ending(ErrorKind kind, const std::filesystem::path& path) {
  auto [found, remedy] = in_its_place(kind, path);
  throw Error(kind, {.file = path.string(),
                     .found = std::move(found),
                     .expected = kind == ErrorKind::bad_input ? "a motion file: " + listed(clip_endings_read())
                                                              : listed(clip_endings_written()),
                     .remedy = std::move(remedy)});
}

const FileFormat& clip_format(const std::filesystem::path& path) {
  const FileFormat* format = find_format(path);
  if (format == nullptr || format->read == nullptr) fail_ending(ErrorKind::bad_input, path);
  return *format;
}

std::vector<Clip> read_wanted(const std::filesystem::path& path, ClipReadOptions options, ClipsWanted wanted) {
  const FileFormat& format = clip_format(path);
  if (!format.companion.empty() && !options.companion) options.companion = companion_of(path, format.companion);
  if (format.list == nullptr && !options.animation.empty() && options.animation != "1") {
    throw Error(ErrorKind::usage, {.file = path.string(),
                                   .found = fmt::format("no animation \"{}\"", options.animation),
                                   .expected = "a file that can hold several",
                                   .remedy = "leave --animation out"});
  }
  return format.read(path, options, wanted);
}

}  // namespace

Clip read_clip(const std::filesystem::path& path, const std::optional<std::filesystem::path>& companion) {
  return read_clip(path, ClipReadOptions{.companion = companion});
}

Clip read_clip(const std::filesystem::path& path, const ClipReadOptions& options) {
  return std::move(read_wanted(path, options, ClipsWanted::one).front());
}

std::vector<Clip> read_clips(const std::filesystem::path& path, const ClipReadOptions& options) {
  return read_wanted(path, options, ClipsWanted::all);
}

std::vector<std::string> clips_of_file(const std::filesystem::path& path) {
  const FileFormat& format = clip_format(path);
  std::vector<std::string> out = format.list == nullptr ? std::vector<std::string>() : format.list(path);
  if (out.size() < 2) out.assign(1, "");
  return out;
}

void write_clip(const std::filesystem::path& path, const Clip& clip) {
  const FileFormat* format = find_format(path);
  if (format == nullptr || format->write == nullptr) fail_ending(ErrorKind::usage, path);
  format->write(path, clip);
}

std::vector<std::filesystem::path> files_read(const std::filesystem::path& path,
                                              const std::optional<std::filesystem::path>& companion) {
  const FileFormat* format = find_format(path);
  if (format == nullptr || format->read == nullptr || format->companion.empty()) return {path};
  return {path, companion ? *companion : companion_of(path, format->companion)};
}

std::vector<std::filesystem::path> files_written(const std::filesystem::path& path) {
  const FileFormat* format = find_format(path);
  if (format == nullptr || format->write == nullptr) fail_ending(ErrorKind::usage, path);
  if (format->companion.empty()) return {path};
  return {path, std::filesystem::path(path).replace_extension(format->companion)};
}

bool is_motion_file(const std::filesystem::path& path) {
  const FileFormat* format = find_format(path);
  return format != nullptr && format->read != nullptr;
}

}  // namespace kinespace
