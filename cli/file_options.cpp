#include "cli/file_options.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/motion/read.h"
#include "kinespace/motion/text.h"

namespace kinespace::cli {
namespace {

namespace fs = std::filesystem;

struct Ending {
  std::string_view text;
  FileKind kind;
};

constexpr std::array endings = {
    Ending{".bvh", FileKind::bvh},   Ending{".amc", FileKind::amc},    Ending{".asf", FileKind::asf},
    Ending{".glb", FileKind::glb},   Ending{".gltf", FileKind::json},  Ending{".svg", FileKind::svg},
    Ending{".png", FileKind::png},   Ending{".ksm", FileKind::stream}, Ending{".kspace", FileKind::database},
    Ending{".npy", FileKind::numpy},
};

// With what is read along with it.
std::vector<fs::path> files_behind(const fs::path& input) {
  if (same_word(input.extension().string(), ".npy")) return {input, input.parent_path() / "triangles.npy"};
  try {
    return files_read(input);
  } catch (const Error&) {
    return {input};  // no skeleton beside an .amc: its reader says so
  }
}

// With what is written along with it.
std::vector<fs::path> files_made(const fs::path& output) {
  if (!same_word(output.extension().string(), ".amc")) return {output};
  return {output, fs::path(output).replace_extension(".asf")};
}

bool same_place(const fs::path& a, const fs::path& b) {
  std::error_code code;
  if (fs::equivalent(a, b, code)) return true;
  const fs::path first = fs::absolute(a, code), second = fs::absolute(b, code);
  return !code && first.lexically_normal() == second.lexically_normal();
}

[[noreturn]] void refuse(const fs::path& output, std::string found, std::string expected) {
  throw Error(ErrorKind::usage, {.file = output.string(),
                                 .found = std::move(found),
                                 .expected = std::move(expected),
                                 .remedy = "give another output name"});
}

// Before the work, not after it.
void require_place_for(const fs::path& output, std::optional<FileKind> kind) {
  std::error_code ignored;
  if (fs::is_directory(output, ignored)) return;
  if (!kind) kind = kind_by_ending(output);
  if (kind) return require_replaceable(output, *kind);
  if (fs::is_regular_file(output, ignored)) {
    refuse(output, "a file", "a folder, or a name with the ending of what is to be written");
  }
}

}  // namespace

std::optional<FileKind> kind_by_ending(const fs::path& path) {
  const std::string ending = path.extension().string();
  const auto known = std::ranges::find_if(endings, [&](const Ending& e) { return same_word(ending, e.text); });
  if (known == endings.end()) return std::nullopt;
  return known->kind;
}

void FileOptions::add(CLI::App* command, std::initializer_list<const char*> names, FileOption::Role role,
                      std::optional<FileKind> kind) {
  // Once for each subcommand: when its options have been read, and before its work begins.
  command->parse_complete_callback([this, command] { check(command); });
  for (const char* name : names) {
    options_.push_back({.command = command, .option = command->get_option(name), .role = role, .kind = kind});
  }
}

void FileOptions::reads(CLI::App* command, std::initializer_list<const char*> options) {
  add(command, options, FileOption::Role::read, {});
}

void FileOptions::updates(CLI::App* command, std::initializer_list<const char*> options) {
  add(command, options, FileOption::Role::updated, {});
}

void FileOptions::writes(CLI::App* command, std::initializer_list<const char*> options, std::optional<FileKind> kind) {
  add(command, options, FileOption::Role::written, kind);
}

void FileOptions::check(const CLI::App* command) const {
  std::vector<fs::path> read;
  std::vector<fs::path> written;
  for (const FileOption& option : options_) {
    if (option.command != command) continue;
    const bool output = option.role == FileOption::Role::written;
    for (const std::string& value : option.option->results()) {
      const auto files = output ? files_made(value) : files_behind(value);
      (output ? written : read).insert((output ? written : read).end(), files.begin(), files.end());
      for (const fs::path& file : files) {
        if (output) require_place_for(file, option.kind);
      }
    }
  }
  for (std::size_t i = 0; i < written.size(); ++i) {
    for (const fs::path& path : read) {
      if (same_place(path, written[i])) refuse(written[i], "the output is the input", "two different files");
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (same_place(written[j], written[i])) refuse(written[i], "two outputs of one name", "two names");
    }
  }
  for (const fs::path& path : written) {
    const fs::path folder = path.parent_path();
    remove_leftovers(folder.empty() ? fs::path(".") : folder);
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) remove_leftovers(path);
  }
}

}  // namespace kinespace::cli
